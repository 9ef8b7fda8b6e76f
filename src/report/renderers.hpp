#pragma once

#include <memory>
#include <string_view>

#include "spindle/report/renderer.hpp"

namespace spindle::report {

std::unique_ptr<Renderer> make_table_renderer(Streams& streams, const Look& look);
std::unique_ptr<Renderer> make_json_renderer(Streams& streams, Verbosity verbosity);
std::unique_ptr<Renderer> make_yaml_renderer(Streams& streams, Verbosity verbosity);
std::unique_ptr<Renderer> make_csv_renderer(Streams& streams, const Look& look);
std::unique_ptr<Renderer> make_value_renderer(Streams& streams, const Look& look);

/// Those of a list that are wanted: the ones that were asked for by key or title, in that order;
/// else all, or all that are always shown. Error `usage` that lists them where one is not there.
Result<std::vector<Column>> chosen_columns(std::span<const Column> columns, const Look& look);

/// Lines for programs. The first one begins on a line of its own, also in a file whose last line a
/// crash or a full disk cut off.
class LineWriter {
 public:
  /// `line_end` is what ends each line; `streams` must outlive it.
  LineWriter(const Streams& streams, std::string_view line_end)
      : streams_(&streams), line_end_(line_end) {}

  /// A line with its end, whole or not at all.
  Result<void> write(std::string_view line);

 private:
  const Streams* streams_;
  std::string_view line_end_;
  bool has_begun_ = false;
};

/// What tables and CSV have in common: everything beside the data goes to stderr as sentences.
class PlainRenderer : public Renderer {
 public:
  PlainRenderer(Streams& streams, Verbosity verbosity) : streams_(streams), verbosity_(verbosity) {}

  Result<void> line(const Record& record, std::string_view plain) override;
  void note(std::string_view sentence) override;
  Result<void> summary(const Record& record, std::string_view sentence) override;
  Result<void> error(const Error& error, WallTime time) override;

 protected:
  [[nodiscard]] Streams& streams() { return streams_; }

 private:
  Streams& streams_;
  Verbosity verbosity_;
};

/// One line on stderr behind "spindle: ", quiet or not.
void say_error(const Streams& streams, const Error& error);

/// The sentence on stderr, unless it is empty or not wanted.
void say_sentence(const Streams& streams, Verbosity verbosity, Severity severity,
                  std::string_view sentence);

}  // namespace spindle::report
