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

/// Appends text that is harmless, on one line; returns how many cells of a terminal it takes.
std::size_t append_cells(std::string& out, std::string_view text);

/// What people see of a record under a column's key: the `shown` of its field of this key, else its
/// cell; "target", "time" and "type" are the record's own. Empty where the field is null: there is
/// none. It stands in the record, or in `made` where it has to be made.
std::string_view shown_text(const Record& record, std::string_view key, const Field* field,
                            std::string& made);

/// The same as programs see it: always the cell, never the field's `shown`.
std::string_view cell_text(const Record& record, std::string_view key, std::string& made);

}  // namespace spindle::report
