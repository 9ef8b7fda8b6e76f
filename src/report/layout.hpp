#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "spindle/report/renderer.hpp"

namespace spindle::report {

/// A cell of a table. What stands in it is part of one text for all cells.
struct Drawn {
  std::size_t begin = 0;
  std::size_t size = 0;
  std::size_t width = 0;  ///< cells of a terminal
  Tone tone = Tone::plain;

  [[nodiscard]] std::string_view in(std::string_view texts) const {
    return texts.substr(begin, size);
  }
};
using Row = std::span<const Drawn>;

/// Appends harmless text to that of all cells.
Drawn append_drawn(std::string& texts, std::string_view text, Tone tone);

/// What the columns of a table become in a room of so many cells.
struct Layout {
  std::vector<bool> is_shown = {};
  std::vector<std::size_t> widths = {};  ///< of the columns that are not shown, too
  std::size_t room = 0;                  ///< cells of a row; 0: as many as it takes
};

/// The widths of columns where there is room for all, and which of them say nothing in any row.
struct Natural {
  std::vector<std::size_t> widths = {};
  std::vector<bool> are_empty = {};
};

/// Puts columns into a room of so many cells, 0: none is too wide. First those give way that may
/// wrap, then those are left out that say nothing, and the lowest ranks; where even that is not
/// enough, the widest texts wrap.
Layout lay_out(std::span<const Column> columns, const Natural& natural, std::size_t room);

/// What stands in the head, or in a record.
enum class RowKind : std::uint8_t { head, record };

/// How a row is drawn: its columns with their layout, and whether in colour.
struct Table {
  std::span<const Column> columns;
  const Layout& layout;
  Color color = Color::off;
  bool has_local_times = false;  ///< whose texts are cut to the widths of their columns
};

/// Appends a row as one or several lines without spaces at their ends. `texts` is that of its
/// cells.
void draw_row(Row row, std::string_view texts, const Table& table, RowKind kind, std::string& out);

/// The same as one line of at most `layout.room` cells, without its end. Texts are cut where they
/// have to be; what stands at the right, as numbers do, is left out instead.
/// Returns how many cells it takes.
std::size_t draw_line(Row row, std::string_view texts, const Table& table, std::string& out);

/// Appends text in the colour of its tone.
void append_colored(std::string& line, std::string_view text, Tone tone, Color color);

/// Whether a column holds times: "time" is the record's own.
bool is_time(const Column& column);

/// Times of a user's zone, the longest form: "2026-11-30 14:00:05.123+01:00".
inline constexpr std::size_t local_time_width = 29;

}  // namespace spindle::report
