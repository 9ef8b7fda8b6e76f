#include "spindle/base/local_time.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>

#include "spindle/base/decimal.hpp"
#include "spindle/base/duration.hpp"
#include "spindle/base/text.hpp"

namespace spindle {
namespace {

using namespace std::chrono_literals;
using std::chrono::days;
using std::chrono::milliseconds;

/// What a clock of some zone shows, as if that were UTC.
using Shown = WallTime;

WallTime from_local(Shown shown, const Clock& clock) {
  // No zone is more than a day away, and none changes twice in two days.
  const auto before = clock.utc_offset(shown - days(1));
  const auto after = clock.utc_offset(shown + days(1));
  const WallTime first = shown - before;
  const WallTime second = shown - after;
  if (clock.utc_offset(first) == before) return first;
  return clock.utc_offset(second) == after ? second : first;
}

/// Takes a number of exactly, or at least one and at most, so many digits off the front.
std::optional<int> take_number(std::string_view& text, std::size_t least, std::size_t most) {
  std::size_t end = 0;
  while (end < std::min(most, text.size()) && text[end] >= '0' && text[end] <= '9') ++end;
  if (end < least) return std::nullopt;
  const auto number = parse_unsigned(text.substr(0, end), 999'999);
  text.remove_prefix(end);
  return number ? std::optional(static_cast<int>(*number)) : std::nullopt;
}

bool take(std::string_view& text, std::string_view word) {
  if (!text.starts_with(word)) return false;
  text.remove_prefix(word.size());
  return true;
}

std::optional<days> take_date(std::string_view& text) {
  std::string_view rest = text;
  const auto year = take_number(rest, 4, 4);
  if (!year || !take(rest, "-")) return std::nullopt;
  const auto month = take_number(rest, 2, 2);
  if (!month || !take(rest, "-")) return std::nullopt;
  const auto day = take_number(rest, 2, 2);
  if (!day) return std::nullopt;
  const auto date = std::chrono::year(*year) / *month / *day;
  if (!date.ok()) return std::nullopt;
  text = rest;
  return std::chrono::sys_days(date).time_since_epoch();
}

/// Digits behind the point: the rest is cut off.
std::optional<milliseconds> take_fraction(std::string_view& text) {
  std::string_view rest = text;
  if (!take(rest, ".")) return 0ms;
  const std::size_t digits = std::min(rest.find_first_not_of("0123456789"), rest.size());
  if (digits == 0) return std::nullopt;
  std::string shown(rest.substr(0, 3));
  shown.resize(std::min<std::size_t>(digits, 3));
  shown.append(3 - shown.size(), '0');
  rest.remove_prefix(digits);
  text = rest;
  return milliseconds(*parse_unsigned(shown, 999));
}

/// "14:00", "14:00:05", "14:00:05.123".
std::optional<milliseconds> take_clock(std::string_view& text) {
  std::string_view rest = text;
  const auto hour = take_number(rest, 1, 2);
  if (!hour || *hour > 23 || !take(rest, ":")) return std::nullopt;
  const auto minute = take_number(rest, 2, 2);
  if (!minute || *minute > 59) return std::nullopt;
  milliseconds time = std::chrono::hours(*hour) + std::chrono::minutes(*minute);
  if (take(rest, ":")) {
    const auto second = take_number(rest, 2, 2);
    if (!second || *second > 59) return std::nullopt;
    const auto fraction = take_fraction(rest);
    if (!fraction) return std::nullopt;
    time += std::chrono::seconds(*second) + *fraction;
  }
  text = rest;
  return time;
}

/// "Z", "+01:00", "-0530", "+01".
std::optional<std::chrono::seconds> take_zone(std::string_view& text) {
  std::string_view rest = text;
  if (take(rest, "Z") || take(rest, "z")) {
    text = rest;
    return 0s;
  }
  const bool is_behind = rest.starts_with('-');
  if (!take(rest, "+") && !take(rest, "-")) return std::nullopt;
  const auto hours = take_number(rest, 2, 2);
  if (!hours || *hours > 23) return std::nullopt;
  int minutes = 0;
  const bool has_colon = take(rest, ":");
  if (has_colon || !rest.empty()) {
    const auto more = take_number(rest, 2, 2);
    if (!more || *more > 59) return std::nullopt;
    minutes = *more;
  }
  text = rest;
  const std::chrono::seconds offset = std::chrono::hours(*hours) + std::chrono::minutes(minutes);
  return is_behind ? -offset : offset;
}

struct Unit {
  std::string_view suffix;
  milliseconds length;
};
constexpr std::array<Unit, 5> units = {
    {{"s", 1s}, {"min", 1min}, {"h", 1h}, {"d", days(1)}, {"w", days(7)}}};

/// "2h", "2h ago", "1.5d".
std::optional<milliseconds> age_of(std::string_view text) {
  if (text.ends_with(" ago")) text.remove_suffix(4);
  const std::size_t end = std::min(text.find_first_not_of(".0123456789"), text.size());
  const auto number = Decimal::parse(text.substr(0, end));
  const auto unit = std::ranges::find(units, text.substr(end), &Unit::suffix);
  if (!number || unit == units.end()) return std::nullopt;
  const auto age = number->times(Decimal(unit->length.count()));
  if (!age) return std::nullopt;
  constexpr milliseconds longest = days(36'525);
  const std::int64_t whole = age->divided_by(Decimal(1)).value_or(-1);
  if (whole < 0 || whole > longest.count()) return std::nullopt;
  return milliseconds(whole);
}

std::optional<days> take_day(std::string_view& text, const Clock& clock) {
  const WallTime now = clock.wall();
  const Shown shown = now + clock.utc_offset(now);
  const auto today = std::chrono::floor<days>(shown.time_since_epoch());
  if (take(text, "today")) return today;
  if (take(text, "yesterday")) return today - days(1);
  if (auto date = take_date(text)) return date;
  const bool is_clock = text.find(':') != std::string_view::npos;
  return is_clock ? std::optional(today) : std::nullopt;
}

/// A day, a time of the day, or both, and perhaps a zone.
std::optional<WallTime> calendar_time(std::string_view text, const Clock& clock) {
  const std::size_t whole = text.size();
  const auto day = take_day(text, clock);
  if (!day) return std::nullopt;
  const bool has_day = text.size() != whole;
  if (text.empty()) return from_local(Shown(*day), clock);
  if (has_day && !take(text, "T") && !take(text, "t") && !take(text, " ")) return std::nullopt;
  const auto time_of_day = take_clock(text);
  if (!time_of_day) return std::nullopt;
  const Shown shown(*day + *time_of_day);
  if (text.empty()) return from_local(shown, clock);
  take(text, " ");
  const auto zone = take_zone(text);
  if (!zone || !text.empty()) return std::nullopt;
  return shown - *zone;
}

}  // namespace

Result<WallTime> parse_time(std::string_view text, const Clock& clock) {
  if (text == "now") return clock.wall();
  if (const auto age = age_of(text)) return clock.wall() - *age;
  if (const auto time = calendar_time(text, clock)) return *time;
  return tl::unexpected(
      Error{.code = Errc::usage,
            .message = fmt::format("'{}' is not a time", text),
            .hint = "write today, yesterday, 14:00, 30min, 2h or 3d (ago), 2026-11-30, '2026-11-30 "
                    "14:00' or 2026-11-30T14:00:00Z"});
}

std::string to_local_text(WallTime time, const Clock& clock) {
  const auto ahead = clock.utc_offset(time);
  std::string text = to_text(time + ahead);
  text[text.find('T')] = ' ';
  text.pop_back();
  const auto minutes = std::chrono::floor<std::chrono::minutes>(ahead < 0s ? -ahead : ahead);
  return fmt::format("{}{}{:02}:{:02}", text, ahead < 0s ? '-' : '+', minutes.count() / 60,
                     minutes.count() % 60);
}

}  // namespace spindle
