#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "spindle/report/record.hpp"

namespace spindle::report {

/// The number of terminal cells that well-formed text takes: combining characters none, East Asian
/// wide ones two, all others one.
std::size_t display_width(std::string_view text);

/// Which end of a text stays when it does not fit.
enum class Keep : std::uint8_t { beginning, end };

/// Printable text of at most so many terminal cells; where something was cut off stands "...".
std::string fitted(std::string_view text, std::size_t cells, Keep keep);

/// What becomes of line breaks and tabs: a run of them is one space, or they stay.
enum class LineBreaks : std::uint8_t { fold, keep };

/// Text that cannot steer a terminal or hide anything: every other control character and every
/// invisible one is shown as `\x1b` or `\u202e` is, and ill-formed UTF-8 as U+FFFD.
std::string printable(std::string_view text, LineBreaks breaks);

/// What stands in a cell of a table, and how many cells of a terminal it takes.
struct Cells {
  std::size_t width = 0;
  std::string text;
};
/// Text that is harmless, on one line.
Cells to_cells(std::string text);

/// What people see of a record under a column's key: the `shown` of its field of this key, else its
/// cell; "target", "time" and "type" are the record's own. Empty where the field is null: there is
/// none.
std::string shown_text(const Record& record, std::string_view key, const Field* field);

/// The same as programs see it: always the cell, never the field's `shown`.
std::string cell_text(const Record& record, std::string_view key);

}  // namespace spindle::report
