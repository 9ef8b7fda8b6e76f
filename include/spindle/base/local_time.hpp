#pragma once

#include <string>
#include <string_view>

#include "spindle/base/clock.hpp"

namespace spindle {

/// Reads a time as people write it: "now", "today", "yesterday", "14:00" (today), "2h" and "2h ago"
/// (s, min, h, d, w; before now), "2026-11-30", "2026-11-30 14:00", "yesterday 14:00", ISO 8601
/// with or without zone. Without one it is the zone of the user: a time that there is twice is
/// the first of the two, one that is skipped is meant as if the clocks had not been changed yet.
/// A date alone is its beginning. Error `usage` otherwise.
Result<WallTime> parse_time(std::string_view text, const Clock& clock);

/// As the user's clock shows it: "2026-11-30 14:00:05.123+01:00".
std::string to_local_text(WallTime time, const Clock& clock);

}  // namespace spindle
