#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "spindle/report/record.hpp"
#include "spindle/report/renderer.hpp"

namespace spindle::report {

/// One line of a terminal, without its end: harmless text, perhaps in colour.
struct ScreenLine {
  std::string text = {};
  std::size_t width = 0;  ///< cells
};

/// Records below each other in columns without a head, each in one line of at most `room` cells.
/// Columns give way as those of a table do; text that still finds no room ends in "...".
std::vector<ScreenLine> screen_lines(std::span<const Column> columns,
                                     std::span<const Record> records, std::size_t room,
                                     Color color);

/// A sentence as such a line.
ScreenLine screen_line(std::string_view text, std::size_t room);

}  // namespace spindle::report
