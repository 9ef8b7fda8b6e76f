#include "page/words.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "spindle/base/decimal.hpp"
#include "spindle/base/text.hpp"

namespace spindle::page {
namespace {

/// The recorder stores every ten seconds until when it heard a tool, and stores that a little
/// later.
constexpr auto fresh_for = std::chrono::seconds(45);

constexpr std::array<std::string_view, 12> months = {"Jan", "Feb", "Mar", "Apr", "May", "Jun",
                                                     "Jul", "Aug", "Sep", "Oct", "Nov", "Dec"};

auto local(WallTime at, const Clock& clock) { return at + clock.utc_offset(at); }

std::string day_before(WallTime at, WallTime now, const Clock& clock) {
  using std::chrono::days;
  const auto day = std::chrono::floor<days>(local(at, clock));
  if (day == std::chrono::floor<days>(local(now, clock))) return {};
  const std::chrono::year_month_day date(day);
  return fmt::format("{} {}, ", static_cast<unsigned>(date.day()),
                     months[static_cast<unsigned>(date.month()) - 1]);
}

std::string heard_words(const Station& station, WallTime now, const Clock& clock) {
  if (!station.heard) return "never heard";
  return "last heard " + minute_text(*station.heard, now, clock);
}

}  // namespace

std::string torque_text(std::int64_t steps) {
  int exponent = -4;
  for (; exponent < -2 && steps % 10 == 0; ++exponent) steps /= 10;
  return Decimal(steps, exponent).to_string();
}

std::string unit_text(std::string_view unit) {
  std::string text;
  for (const char c : unit) text += c == '.' ? std::string("\u00b7") : std::string(1, c);
  return text;
}

std::string time_text(WallTime at, WallTime now, const Clock& clock) {
  const auto shown = local(at, clock);
  const std::chrono::hh_mm_ss time(std::chrono::floor<std::chrono::seconds>(
      shown - std::chrono::floor<std::chrono::days>(shown)));
  return fmt::format("{}{:02}:{:02}:{:02}", day_before(at, now, clock), time.hours().count(),
                     time.minutes().count(), time.seconds().count());
}

std::string minute_text(WallTime at, WallTime now, const Clock& clock) {
  const std::string text = time_text(at, now, clock);
  return text.substr(0, text.size() - 3);
}

std::string spoken(const Fastening& result, std::string_view unit) {
  std::string text = result.is_ok ? "OK" : "NG";
  if (result.torque) text += fmt::format(", {} {}", torque_text(*result.torque), unit_text(unit));
  if (result.error != 0) text += fmt::format(", E{} {}", result.error, result.text);
  return text;
}

std::string missed_words(const MissedSum& sum) {
  if (sum.count == 0)
    return sum.is_unsure || sum.at_least ? "perhaps results missed" : "no result missed";
  const bool more = sum.is_unsure || sum.at_least;
  return fmt::format("{}{} missed", more ? "at least " : "", counted(sum.count, "result"));
}

std::string missed_figure(const MissedSum& sum) {
  const bool more = sum.is_unsure || sum.at_least;
  if (sum.count == 0 && more) return "?";
  return fmt::format("{}{}", sum.count, more ? "+" : "");
}

LinkView link_view(const Station& station, Recorder recorder, WallTime now, const Clock& clock) {
  const bool is_fresh = station.heard && *station.heard + fresh_for >= now;
  if (recorder == Recorder::stopped) {
    return {.word = "Not known", .detail = "not recording, " + heard_words(station, now, clock)};
  }
  const bool is_down = station.link && station.link->down_since;
  if (is_down && recorder == Recorder::runs) {
    return {
        .shown = LinkShown::down,
        .word = "No link",
        .detail = fmt::format("since {}: {}", minute_text(*station.link->down_since, now, clock),
                              station.link->message)};
  }
  if (is_fresh && !is_down) return {.shown = LinkShown::up, .word = "Connected"};
  return {.word = "Not known", .detail = heard_words(station, now, clock)};
}

}  // namespace spindle::page
