#pragma once

#include <span>
#include <string>
#include <variant>
#include <vector>

#include "spindle/report/renderer.hpp"

namespace spindle::commands {

/// A renderer that keeps what it is told of one tool, so that tools which are handled side by side
/// are shown one after the other. Never fails.
class RecordingRenderer final : public report::Renderer {
 public:
  RecordingRenderer() = default;
  RecordingRenderer(const RecordingRenderer&) = delete;
  RecordingRenderer& operator=(const RecordingRenderer&) = delete;
  ~RecordingRenderer() override = default;

  Result<void> begin(std::span<const report::Column> columns) override;
  Result<void> record(const report::Record& record) override;
  Result<void> end() override { return {}; }
  Result<void> line(const report::Record& record, std::string_view plain) override;
  void note(std::string_view sentence) override;
  Result<void> summary(const report::Record& record, std::string_view sentence) override;
  Result<void> error(const Error& error, WallTime time) override;

  struct Line {
    report::Record record;
    std::string plain;
  };
  struct Fault {
    Error error;
    WallTime time;
  };
  using Entry = std::variant<report::Record, Line, std::string, Fault>;

  /// One list of records with what was said meanwhile. What is said before the first list belongs
  /// to it.
  struct Section {
    std::vector<report::Column> columns = {};
    std::vector<Entry> entries = {};
  };

  [[nodiscard]] const std::vector<Section>& sections() const { return sections_; }
  [[nodiscard]] const std::vector<Line>& summaries() const { return summaries_; }

 private:
  std::vector<Section> sections_ = {{}};
  std::vector<Line> summaries_ = {};
};

/// Tells the summary of one of several tools, with its name in front of the sentence.
Result<void> tell_under_name(const RecordingRenderer::Line& summary, report::Renderer& renderer);

/// The columns with one for the tool's name in front.
std::vector<report::Column> with_target_column(std::span<const report::Column> columns);

/// Shows the recordings of several tools: list by list, each with the tools in the order given and
/// a column for their names; a note that several tools have is told once. Then their summaries,
/// each under the tool's name.
Result<void> replay(std::span<const RecordingRenderer* const> recordings,
                    report::Renderer& renderer);

}  // namespace spindle::commands
