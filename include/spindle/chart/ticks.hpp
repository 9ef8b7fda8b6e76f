#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace spindle::chart {

/// A mark of an axis.
struct Tick {
  double at = 0;
  std::string label;
  /// What the label leaves open, such as the day of a time; only where it is another than before.
  std::string context = {};
};

/// Round numbers (1, 2 or 5 times a power of ten apart, but no less than `least_step`) from `low`
/// to `high`, both finite: at most `most` + 1 of them.
std::vector<Tick> number_ticks(double low, double high, int most, double least_step = 0);

/// Round local times from `low` to `high`, in milliseconds since 1970-01-01 UTC: at most `most` + 1
/// of them.
std::vector<Tick> time_ticks(std::int64_t low, std::int64_t high, int most, int utc_offset_minutes);

/// "2026-03-12 10:04:05 +01:00".
std::string time_text(std::int64_t milliseconds, int utc_offset_minutes);

/// "UTC+01:00"; "UTC" alone.
std::string zone_text(int utc_offset_minutes);

/// The number with a fixed number of decimals; large and tiny ones as "1.5e12". "–" for what is not
/// finite.
std::string number_text(double value, int decimals);

}  // namespace spindle::chart
