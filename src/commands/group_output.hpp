#pragma once

#include <cstddef>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "recording.hpp"
#include "spindle/report/renderer.hpp"

namespace spindle::commands {

/// Where what several tools say goes while they are handled side by side: a renderer for each.
class GroupOutput {
 public:
  GroupOutput() = default;
  GroupOutput(const GroupOutput&) = delete;
  GroupOutput& operator=(const GroupOutput&) = delete;
  virtual ~GroupOutput() = default;

  /// That of one tool, by its place. Each is used by one thread at a time.
  virtual report::Renderer& of_tool(std::size_t index) = 0;
  /// Whether what is said is shown at once.
  [[nodiscard]] virtual bool is_live() const = 0;
  /// Shows what waited for the end, once all tools are done.
  virtual Result<void> end() = 0;
};

/// Shows the tools one after the other, list by list, when all are done; see replay().
class RecordedOutput final : public GroupOutput {
 public:
  /// `renderer` must outlive it.
  RecordedOutput(std::size_t tools, report::Renderer& renderer);

  report::Renderer& of_tool(std::size_t index) override { return *recordings_.at(index); }
  [[nodiscard]] bool is_live() const override { return false; }
  Result<void> end() override;

 private:
  std::vector<std::unique_ptr<RecordingRenderer>> recordings_ = {};
  report::Renderer* renderer_;
};

/// One list with a column for the tools' names, to which several threads add what comes when it
/// comes. The summaries of the tools follow it, each under its tool's name.
class SharedOutput final : public GroupOutput {
 public:
  /// Begins the list; `columns` name the tools, too. `renderer` must outlive it.
  SharedOutput(std::size_t tools, std::span<const report::Column> columns,
               report::Renderer& renderer);
  ~SharedOutput() override;

  report::Renderer& of_tool(std::size_t index) override;
  [[nodiscard]] bool is_live() const override { return true; }
  Result<void> end() override;

 private:
  class Member;

  /// Draws, unless there is no reader any more.
  template <typename Draw>
  Result<void> draw(Draw draw);

  std::mutex mutex_ = {};
  report::Renderer* renderer_;
  Result<void> drawn_;
  std::vector<std::unique_ptr<Member>> members_;
};

}  // namespace spindle::commands
