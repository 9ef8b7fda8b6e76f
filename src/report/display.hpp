#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "spindle/report/record.hpp"

namespace spindle::report {

/// The number of terminal cells that well-formed text takes: combining characters none, East Asian
/// wide ones two, all others one.
std::size_t display_width(std::string_view text);

/// What becomes of line breaks and tabs: a run of them is one space, or they stay.
enum class LineBreaks : std::uint8_t { fold, keep };

/// Text that cannot steer a terminal: every other control character is shown as `\x1b` is, and
/// ill-formed UTF-8 as U+FFFD.
std::string printable(std::string_view text, LineBreaks breaks);

/// What people see of a record under a column's key: the field's `shown`, else its cell; "target",
/// "time" and "type" are the record's own. Empty when the record has no such field.
std::string shown_text(const Record& record, std::string_view key);

/// The same as programs see it: always the cell, never the field's `shown`.
std::string cell_text(const Record& record, std::string_view key);

}  // namespace spindle::report
