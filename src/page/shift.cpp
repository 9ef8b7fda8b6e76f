#include "page/shift.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "spindle/base/local_time.hpp"
#include "spindle/base/text.hpp"

namespace spindle::page {
namespace {

using std::chrono::days;
using std::chrono::minutes;

std::optional<minutes> time_of_day(std::string_view text) {
  constexpr std::size_t length = 5;
  if (text.size() != length || text[2] != ':') return std::nullopt;
  const auto hour = parse_unsigned(text.substr(0, 2), 23);
  const auto minute = parse_unsigned(text.substr(3), 59);
  if (!hour || !minute) return std::nullopt;
  return minutes(*hour * 60 + *minute);
}

Error bad_shift(std::string_view text) {
  return {.code = Errc::usage,
          .message = fmt::format("'{}' is no time at which shifts begin", text),
          .hint = "it takes times of day, such as 06:00,14:00,22:00",
          .name = "--shift"};
}

/// When the clocks of the zone show this on a day.
std::optional<WallTime> moment(std::chrono::sys_days day, minutes time, const Clock& clock) {
  const std::chrono::year_month_day date(day);
  const auto found =
      parse_time(fmt::format("{:04}-{:02}-{:02} {:02}:{:02}", static_cast<int>(date.year()),
                             static_cast<unsigned>(date.month()), static_cast<unsigned>(date.day()),
                             time.count() / 60, time.count() % 60),
                 clock);
  if (!found) return std::nullopt;
  return *found;
}

}  // namespace

Result<ShiftTimes> parse_shifts(std::string_view text) {
  if (text.empty()) return ShiftTimes{minutes(0)};
  ShiftTimes times;
  for (const std::string_view part : split(text, ',')) {
    const auto time = time_of_day(part);
    if (!time) return tl::unexpected(bad_shift(part));
    times.push_back(*time);
  }
  std::sort(times.begin(), times.end());
  times.erase(std::unique(times.begin(), times.end()), times.end());
  return times;
}

Shift shift_at(WallTime now, const ShiftTimes& times, const Clock& clock) {
  const auto today = std::chrono::floor<days>(now + clock.utc_offset(now));
  std::optional<WallTime> last;
  std::optional<WallTime> next;
  for (int day = -1; day <= 1; ++day) {
    for (const minutes time : times) {
      const auto begin = moment(today + days(day), time, clock);
      if (!begin) continue;
      if (*begin <= now) {
        last = last ? std::max(*last, *begin) : *begin;
      } else {
        next = next ? std::min(*next, *begin) : *begin;
      }
    }
  }
  return {.begin = last.value_or(now - days(1)), .end = next.value_or(now + days(1))};
}

}  // namespace spindle::page
