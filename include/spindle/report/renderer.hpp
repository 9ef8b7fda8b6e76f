#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "spindle/base/error.hpp"
#include "spindle/report/record.hpp"
#include "spindle/report/streams.hpp"

namespace spindle::report {

/// `svg` is for commands that draw; what they say beside the drawing is as in a table. `wide` is a
/// table with every column, however wide; `value` only the values, a line for each record.
enum class Format : std::uint8_t { table, json, csv, svg, wide, value, yaml };
enum class Align : std::uint8_t { left, right };

/// Whether it is for people who read it on a screen.
constexpr bool is_table(Format format) { return format == Format::table || format == Format::wide; }

/// What becomes of a column where a terminal has no room for its cells. Nothing is ever cut off.
enum class Narrow : std::uint8_t {
  keep,   ///< it stays as wide as it is
  wrap,   ///< its text goes on in the next lines, within the column
  below,  ///< the last column: what finds no room behind the others stands below the row
};

/// Where a column is shown.
enum class Shown : std::uint8_t {
  always,
  wide,  ///< only with Format::wide, in CSV, and where it was asked for by name
};

/// How a column gives way on a terminal that is too narrow for its table.
struct Room {
  std::uint8_t rank = 0;  ///< the lowest is left out first; 0: it stays
  Narrow narrow = Narrow::keep;
  std::uint8_t least = 0;       ///< cells that a column that wraps has at least
  std::string_view usual = {};  ///< where it is left out, any other text stands in the last column
  Shown shown = Shown::always;
};

/// A column that may be left out; the lowest rank goes first.
constexpr Room left_out(std::uint8_t rank) { return {.rank = rank}; }
/// One that wraps, down to so many cells, before any is left out.
constexpr Room wrapped(std::uint8_t least, std::uint8_t rank = 0) {
  return {.rank = rank, .narrow = Narrow::wrap, .least = least};
}
/// The last one, which stands below the row where it has to.
constexpr Room below_row() { return {.narrow = Narrow::below}; }
/// One that is not shown unless all are wanted, or it itself.
constexpr Room only_wide() { return {.shown = Shown::wide}; }

/// A column of a table or CSV file, filled from the field with this key ("target", "time" and
/// "type" are the record's own). CSV uses the key as its header.
struct Column {
  std::string title;
  std::string key;
  Align align = Align::left;
  /// Terminal cells kept for it, 0: measured. A table all of whose columns have a width is drawn
  /// row by row instead of at end(), as a stream of events needs.
  std::size_t width = 0;
  Room room = {};
};

/// Draws records. Every function fails only with `closed_pipe` or `storage` (the stream cannot be
/// written), and begin() also with `usage`: a column was asked for that is not there. Not
/// thread-safe: commands with several tools put a mutex around it.
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
  /// The sentence on stderr, with a command to try where there is one, and for JSON also an `error`
  /// line on stdout.
  virtual Result<void> error(const Error& error, WallTime time) = 0;
};

/// Whether summaries, notes and progress stand beside the records (--quiet).
enum class Verbosity : std::uint8_t { quiet, normal };

/// How records are to look.
struct Look {
  Format format = Format::table;
  Verbosity verbosity = Verbosity::normal;
  std::vector<std::string> columns =
      {};                        ///< those that are wanted, by key or title; none: as usual
  const Clock* clock = nullptr;  ///< whose zone times on a terminal are in; null: UTC
};

/// `streams` and the clock must outlive it. On a terminal whose width is known a table fits it.
std::unique_ptr<Renderer> make_renderer(const Look& look, Streams& streams);
std::unique_ptr<Renderer> make_renderer(Format format, Streams& streams, Verbosity verbosity);

/// How important a line on stderr is, as syslog(3) counts it.
enum class Severity : std::uint8_t { error = 3, warning = 4, notice = 5, informational = 6 };

/// The text with line breaks in place of spaces, so that no line is wider than people read well; a
/// word that is wider stays whole. Lines behind the first one are indented.
std::string wrapped(std::string_view text, std::size_t columns = 100);

/// How wide a line on stderr may be: 100 columns, or those of a narrower terminal.
std::size_t columns_of(const Streams& streams);

/// The text as one sentence on stderr, on as many lines as it takes, marked with its severity
/// (sd-daemon(3)) where the system's journal reads that.
void say_line(const Streams& streams, Severity severity, std::string_view text);

/// The same as one line, however wide: a frame is looked for by programs, too.
void say_frame(const Streams& streams, std::string_view text);

/// What users have to know about the values that are shown: one line on stderr, quiet or not. May
/// be called from any thread.
void say_warning(const Streams& streams, std::string_view sentence);

/// The `error` record of the contract.
Record error_record(const Error& error, WallTime time);

}  // namespace spindle::report
