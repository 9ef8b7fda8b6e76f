#pragma once

#include <chrono>
#include <string>
#include <string_view>
#include <vector>

#include "spindle/base/clock.hpp"

namespace spindle::page {

/// When shifts begin, by the clocks of the user's zone.
using ShiftTimes = std::vector<std::chrono::minutes>;

/// Reads "06:00,14:00,22:00"; an empty text is midnight. Sorted. Error `usage` for anything else.
Result<ShiftTimes> parse_shifts(std::string_view text);

/// From `begin` on, `end` not included.
struct Shift {
  WallTime begin = {};
  WallTime end = {};
};

/// The shift that a moment belongs to; there must be at least one time. Where clocks are changed, a
/// shift is an hour longer or shorter.
Shift shift_at(WallTime now, const ShiftTimes& times, const Clock& clock);

}  // namespace spindle::page
