#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "spindle/base/error.hpp"
#include "spindle/report/record.hpp"
#include "spindle/report/streams.hpp"

namespace spindle::report {

enum class Format : std::uint8_t { table, json, csv };
enum class Align : std::uint8_t { left, right };

/// A column of a table or CSV file, filled from the field with this key ("target", "time" and
/// "type" are the record's own). CSV uses the key as its header.
struct Column {
  std::string title;
  std::string key;
  Align align = Align::left;
  /// Terminal cells kept for it, 0: measured. A table all of whose columns have a width is drawn
  /// row by row instead of at end(), as a stream of events needs.
  std::size_t width = 0;
};

/// Draws records. Every function fails only with `closed_pipe` or `storage` (the stream cannot be
/// written). Not thread-safe: commands with several tools put a mutex around it.
class Renderer {
 public:
  Renderer() = default;
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;
  virtual ~Renderer() = default;

  /// Announces the columns of the records to come. JSON ignores it.
  virtual Result<void> begin(std::span<const Column> columns) = 0;
  virtual Result<void> record(const Record& record) = 0;
  /// Draws what was held back to align it. CSV without records still has its header line.
  virtual Result<void> end() = 0;
  /// A record that stands for itself, at once: a JSON line, or `plain` as a line of its own on
  /// stdout.
  virtual Result<void> line(const Record& record, std::string_view plain) = 0;
  /// Something that people should know: a sentence on stderr, left out when verbosity is quiet.
  virtual void note(std::string_view sentence) = 0;
  /// The closing counts: a JSON line on stdout, or `sentence` on stderr.
  virtual Result<void> summary(const Record& record, std::string_view sentence) = 0;
  /// The sentence on stderr, and for JSON also an `error` line on stdout.
  virtual Result<void> error(const Error& error, WallTime time) = 0;
};

/// Whether summaries, notes and progress stand beside the records (--quiet).
enum class Verbosity : std::uint8_t { quiet, normal };

std::unique_ptr<Renderer> make_renderer(Format format, Streams& streams, Verbosity verbosity);

/// How important a line on stderr is, as syslog(3) counts it.
enum class Severity : std::uint8_t { error = 3, warning = 4, notice = 5, informational = 6 };

/// The text as one line on stderr, marked with its severity (sd-daemon(3)) where the system's
/// journal reads that.
void say_line(const Streams& streams, Severity severity, std::string_view text);

/// What users have to know about the values that are shown: one line on stderr, quiet or not. May
/// be called from any thread.
void say_warning(const Streams& streams, std::string_view sentence);

/// The `error` record of the contract.
Record error_record(const Error& error, WallTime time);

}  // namespace spindle::report
