#include "spindle/chart/ticks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <limits>

#include "spindle/base/decimal.hpp"
#include "text.hpp"

namespace spindle::chart {
namespace {

// From here on, and below a step of this, digits are more than one reads.
constexpr double large = 1e9;
constexpr double tiny_step = 1e-6;
// Steps that a double holds apart beside such numbers.
constexpr double finest = 1e-12;

/// A step of 1, 2 or 5 times a power of ten.
struct Step {
  std::int64_t factor;
  int exponent;
  /// Divided rather than multiplied by a fraction: that is the nearest double to the decimal.
  [[nodiscard]] double times(std::int64_t count) const {
    const auto mantissa = static_cast<double>(count * factor);
    return exponent < 0 ? mantissa / std::pow(10.0, -exponent)
                        : mantissa * std::pow(10.0, exponent);
  }
};

Step step_of(double least) {
  // Between two of the smallest numbers that there are lies no step.
  least = std::max(least, std::numeric_limits<double>::min());
  // One lower than the logarithm says, which may be rounded up.
  int exponent = static_cast<int>(std::floor(std::log10(least))) - 1;
  while (true) {
    for (const std::int64_t factor : {1, 2, 5}) {
      const Step step{.factor = factor, .exponent = exponent};
      if (step.times(1) >= least * (1 - 1e-9)) return step;
    }
    ++exponent;
  }
}

/// "1.5e12" for 15 × 10^11.
std::string scientific(std::int64_t mantissa, int exponent) {
  if (mantissa == 0) return "0";
  while (mantissa % 10 == 0) {
    mantissa /= 10;
    ++exponent;
  }
  std::string digits = fmt::format("{}", std::abs(mantissa));
  exponent += static_cast<int>(digits.size()) - 1;
  if (digits.size() > 1) digits.insert(1, ".");
  return fmt::format("{}{}e{}", mantissa < 0 ? "-" : "", digits, exponent);
}

std::string plain(std::int64_t mantissa, int exponent) {
  if (exponent < 0) return Decimal(mantissa, exponent).to_string();
  for (; exponent > 0; --exponent) mantissa *= 10;
  return (mantissa < 0 ? "-" : "") + grouped(static_cast<std::uint64_t>(std::abs(mantissa)));
}

using std::chrono::days;
using std::chrono::sys_days;

constexpr std::int64_t second = 1000;
constexpr std::int64_t minute = 60 * second;
constexpr std::int64_t hour = 60 * minute;
constexpr std::int64_t day = 24 * hour;
// The years 1 to 9999.
constexpr std::int64_t earliest = -62'135'596'800'000;
constexpr std::int64_t latest = 253'402'300'799'999;

enum class Unit : std::uint8_t { of_day, date, month };

struct TimeStep {
  Unit unit;
  std::int64_t count;
  /// About, in milliseconds.
  [[nodiscard]] std::int64_t length() const {
    return count * (unit == Unit::of_day ? 1 : unit == Unit::date ? day : 30 * day);
  }
};

constexpr TimeStep ms(std::int64_t count) { return {.unit = Unit::of_day, .count = count}; }

constexpr std::array time_steps = {
    ms(1),
    ms(2),
    ms(5),
    ms(10),
    ms(20),
    ms(50),
    ms(100),
    ms(200),
    ms(500),
    ms(second),
    ms(2 * second),
    ms(5 * second),
    ms(10 * second),
    ms(15 * second),
    ms(30 * second),
    ms(minute),
    ms(2 * minute),
    ms(5 * minute),
    ms(10 * minute),
    ms(15 * minute),
    ms(30 * minute),
    ms(hour),
    ms(2 * hour),
    ms(3 * hour),
    ms(6 * hour),
    ms(12 * hour),
    TimeStep{Unit::date, 1},
    TimeStep{Unit::date, 2},
    TimeStep{Unit::date, 7},
    TimeStep{Unit::date, 14},
    TimeStep{Unit::month, 1},
    TimeStep{Unit::month, 2},
    TimeStep{Unit::month, 3},
    TimeStep{Unit::month, 6},
    TimeStep{Unit::month, 12},
    TimeStep{Unit::month, 24},
    TimeStep{Unit::month, 60},
    TimeStep{Unit::month, 120},
    TimeStep{Unit::month, 240},
    TimeStep{Unit::month, 600},
    TimeStep{Unit::month, 1200},
    TimeStep{Unit::month, 2400},
    TimeStep{Unit::month, 6000},
    TimeStep{Unit::month, 12000},
    TimeStep{Unit::month, 60000},
};

/// A local time in its parts.
struct Civil {
  int year;
  unsigned month;
  unsigned day;
  std::int64_t of_day;  ///< milliseconds
};

std::int64_t floored(std::int64_t number, std::int64_t by) {
  return number / by - (number % by < 0 ? 1 : 0);
}

Civil civil(std::int64_t local) {
  const std::int64_t number = floored(local, day);
  const std::chrono::year_month_day date{sys_days{days{static_cast<int>(number)}}};
  return {.year = static_cast<int>(date.year()),
          .month = static_cast<unsigned>(date.month()),
          .day = static_cast<unsigned>(date.day()),
          .of_day = local - number * day};
}

/// The first of the month with this number since the year 0.
std::int64_t local_of_month(std::int64_t number) {
  const auto year = std::chrono::year{static_cast<int>(floored(number, 12))};
  const auto month =
      std::chrono::month{static_cast<unsigned>(number - floored(number, 12) * 12) + 1};
  return sys_days{year / month / 1}.time_since_epoch().count() * day;
}

/// Where the step of this number begins, in local time.
std::int64_t local_of(TimeStep step, std::int64_t number) {
  if (step.unit == Unit::of_day) return number * step.count;
  // Weeks begin on Mondays: 1970-01-05 was one.
  if (step.unit == Unit::date) return (number * step.count + (step.count % 7 == 0 ? 4 : 0)) * day;
  return local_of_month(number * step.count);
}

/// A number of a step that begins no later.
std::int64_t number_before(TimeStep step, std::int64_t local) {
  if (step.unit == Unit::of_day) return floored(local, step.count);
  if (step.unit == Unit::date) return floored(floored(local, day), step.count) - 1;
  const Civil at = civil(local);
  return floored(std::int64_t{at.year} * 12 + at.month - 1, step.count);
}

std::string clock_text(std::int64_t of_day, std::int64_t resolution) {
  std::string text = fmt::format("{:02}:{:02}", of_day / hour, of_day / minute % 60);
  if (resolution < minute) text += fmt::format(":{:02}", of_day / second % 60);
  if (resolution < second) text += fmt::format(".{:03}", of_day % second);
  return text;
}

std::string date_text(const Civil& at) {
  return fmt::format("{:04}-{:02}-{:02}", at.year, at.month, at.day);
}

Tick time_tick(TimeStep step, std::int64_t local, std::int64_t utc) {
  constexpr std::array months = {"Jan", "Feb", "Mar", "Apr", "May", "Jun",
                                 "Jul", "Aug", "Sep", "Oct", "Nov", "Dec"};
  const Civil at = civil(local);
  const auto x = static_cast<double>(utc);
  if (step.unit == Unit::of_day) {
    return {.at = x, .label = clock_text(at.of_day, step.count), .context = date_text(at)};
  }
  const std::string year = fmt::format("{}", at.year);
  const std::string month = months.at(at.month - 1);
  if (step.unit == Unit::date) {
    return {.at = x, .label = fmt::format("{} {}", at.day, month), .context = year};
  }
  if (step.count < 12) return {.at = x, .label = month, .context = year};
  return {.at = x, .label = year};
}

}  // namespace

std::vector<Tick> number_ticks(double low, double high, int most, double least_step) {
  const double size = std::max(std::abs(low), std::abs(high));
  const double least = std::max({(high - low) / std::max(most, 1), least_step, size * finest});
  if (!(high > low) || !std::isfinite(least)) {
    return {{.at = low, .label = fmt::format("{:.6g}", low)}};
  }
  const Step step = step_of(least);
  const bool is_scientific = size >= large || step.times(1) < tiny_step;
  const double length = step.times(1);
  const auto first = static_cast<std::int64_t>(std::ceil(low / length - 1e-9));
  const auto last = static_cast<std::int64_t>(std::floor(high / length + 1e-9));
  std::vector<Tick> ticks;
  for (std::int64_t count = first; count <= last; ++count) {
    const std::int64_t mantissa = count * step.factor;
    ticks.push_back({.at = step.times(count),
                     .label = is_scientific ? scientific(mantissa, step.exponent)
                                            : plain(mantissa, step.exponent)});
  }
  return ticks;
}

std::vector<Tick> time_ticks(std::int64_t low, std::int64_t high, int most,
                             int utc_offset_minutes) {
  low = std::clamp(low, earliest, latest);
  high = std::clamp(high, low, latest);
  const auto* const step =
      std::find_if(time_steps.begin(), std::prev(time_steps.end()), [&](const TimeStep& candidate) {
        return (high - low) / candidate.length() <= std::max(most, 1);
      });
  const std::int64_t offset = std::int64_t{utc_offset_minutes} * minute;
  std::vector<Tick> ticks;
  std::string context;
  for (std::int64_t number = number_before(*step, low + offset);; ++number) {
    const std::int64_t local = local_of(*step, number);
    if (local - offset > high) return ticks;
    if (local - offset < low) continue;
    Tick tick = time_tick(*step, local, local - offset);
    if (tick.context == context) {
      tick.context.clear();
    } else {
      context = tick.context;
    }
    ticks.push_back(std::move(tick));
  }
}

std::string time_text(std::int64_t milliseconds, int utc_offset_minutes) {
  const std::int64_t local =
      std::clamp(milliseconds, earliest, latest) + std::int64_t{utc_offset_minutes} * minute;
  const Civil at = civil(local);
  const int size = std::abs(utc_offset_minutes);
  return fmt::format("{} {} {}{:02}:{:02}", date_text(at), clock_text(at.of_day, second),
                     utc_offset_minutes < 0 ? '-' : '+', size / 60, size % 60);
}

std::string zone_text(int utc_offset_minutes) {
  if (utc_offset_minutes == 0) return "UTC";
  const int size = std::abs(utc_offset_minutes);
  return fmt::format("UTC{}{:02}:{:02}", utc_offset_minutes < 0 ? '-' : '+', size / 60, size % 60);
}

std::string number_text(double value, int decimals) {
  if (!std::isfinite(value)) return "\u2013";
  decimals = std::clamp(decimals, 0, 9);
  const double size = std::abs(value);
  if (size >= large || (size > 0 && size < 0.5 * std::pow(10.0, -decimals))) {
    std::string text = fmt::format("{:.3g}", value);
    // "1.5e12", "1.5e-7": as the labels of axes.
    const std::size_t exponent = text.find('e');
    if (exponent == std::string::npos) return text;
    std::size_t digits = exponent + 1;
    if (text[digits] == '+') text.erase(digits, 1);
    if (text[digits] == '-') ++digits;
    while (text[digits] == '0' && digits + 1 < text.size()) text.erase(digits, 1);
    return text;
  }
  const std::string text = fmt::format("{:.{}f}", value, decimals);
  // No "-0.00".
  const bool is_zero = text.find_first_of("123456789") == std::string::npos;
  return is_zero && text.starts_with('-') ? text.substr(1) : text;
}

}  // namespace spindle::chart
