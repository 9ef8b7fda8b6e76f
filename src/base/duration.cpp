#include "spindle/base/duration.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "spindle/base/decimal.hpp"

namespace spindle {
namespace {

using namespace std::chrono_literals;

struct Unit {
  std::string_view suffix;
  Duration length;
};

constexpr std::array<Unit, 5> units_from_largest = {
    {{"h", 1h}, {"min", 1min}, {"s", 1s}, {"ms", 1ms}, {"us", 1us}}};

constexpr Duration longest = 30 * 24h;

tl::unexpected<Error> refuse(std::string message) {
  return tl::unexpected(Error{.code = Errc::usage,
                              .message = std::move(message),
                              .hint = "write a number and a unit: 250us, 500ms, 2s, 5min, 1h"});
}

// Exact nanoseconds; empty when the text is no number, is signed, or has parts of a nanosecond.
std::optional<Duration> scaled(std::string_view number, Duration unit) {
  if (number.starts_with('-') || number.starts_with('+')) return std::nullopt;
  const auto decimal = Decimal::parse(number);
  if (!decimal) return std::nullopt;
  const auto product = decimal->times(Decimal(unit.count()));
  if (!product) return std::nullopt;
  const auto nanoseconds = product->divided_by(Decimal(1));
  if (!nanoseconds) return std::nullopt;
  return Duration(*nanoseconds);
}

}  // namespace

Result<Duration> parse_duration(std::string_view text) {
  if (text == "0") return Duration::zero();
  const std::size_t suffix_at = std::min(text.find_first_not_of("+-.0123456789"), text.size());
  const std::string_view suffix = text.substr(suffix_at);
  const auto unit = std::ranges::find(units_from_largest, suffix, &Unit::suffix);
  if (unit == units_from_largest.end()) return refuse(fmt::format("'{}' is not a duration", text));

  const auto duration = scaled(text.substr(0, suffix_at), unit->length);
  if (!duration) return refuse(fmt::format("'{}' is not a duration", text));
  if (*duration > longest) return refuse(fmt::format("'{}' is longer than 30 days", text));
  return *duration;
}

std::string to_text(Duration duration) {
  if (duration == Duration::zero()) return "0s";
  const auto unit = std::ranges::find_if(units_from_largest, [duration](const Unit& candidate) {
    return duration % candidate.length == Duration::zero();
  });
  if (unit != units_from_largest.end()) {
    return fmt::format("{}{}", duration / unit->length, unit->suffix);
  }
  std::string microseconds = Decimal(duration.count(), -3).to_string();
  microseconds.erase(microseconds.find_last_not_of('0') + 1);
  return microseconds + "us";
}

std::string to_text(WallTime time) {
  const auto day = std::chrono::floor<std::chrono::days>(time);
  const std::chrono::year_month_day date(day);
  const std::chrono::hh_mm_ss clock(time - day);
  return fmt::format("{:04}-{:02}-{:02}T{:02}:{:02}:{:02}.{:03}Z", static_cast<int>(date.year()),
                     static_cast<unsigned>(date.month()), static_cast<unsigned>(date.day()),
                     clock.hours().count(), clock.minutes().count(), clock.seconds().count(),
                     clock.subseconds().count());
}

}  // namespace spindle
