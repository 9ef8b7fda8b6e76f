#pragma once

#include <string>
#include <string_view>

#include "spindle/base/clock.hpp"

namespace spindle {

/// Reads "500ms", "2s", "1.5s", "5min", "1h", "5us" (exact decimals, no sign, no spaces; a bare "0"
/// is allowed). Error `usage` otherwise, or when it is longer than 30 days.
Result<Duration> parse_duration(std::string_view text);

/// Calendar time in UTC: "2026-11-22T10:15:30.123Z".
std::string to_text(WallTime time);

/// The shortest exact form that parse_duration() reads back: "1s", "1500ms", "5min".
std::string to_text(Duration duration);

}  // namespace spindle
