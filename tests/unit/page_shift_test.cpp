#include <doctest/doctest.h>

#include <functional>
#include <initializer_list>
#include <string>
#include <utility>

#include "page/shift.hpp"
#include "spindle/base/duration.hpp"

using namespace spindle;
using namespace std::chrono_literals;

namespace {

WallTime utc(int year, unsigned month, unsigned day, int hour = 0, int minute = 0) {
  return std::chrono::sys_days(std::chrono::year(year) / std::chrono::month(month) /
                               std::chrono::day(day)) +
         std::chrono::hours(hour) + std::chrono::minutes(minute);
}

/// Central Europe in 2026: two hours ahead from March 29 to October 25, 01:00 UTC.
class MiddleEurope final : public Clock {
 public:
  [[nodiscard]] TimePoint now() const override { return {}; }
  [[nodiscard]] WallTime wall() const override { return {}; }
  [[nodiscard]] std::chrono::seconds utc_offset(WallTime time) const override {
    return time >= utc(2026, 3, 29, 1) && time < utc(2026, 10, 25, 1) ? 2h : 1h;
  }
  Result<void> sleep_until(TimePoint /*deadline*/) override { return {}; }
};

/// "11-30 05:00 - 11-30 13:00", in UTC.
std::string shift(const std::string& times, WallTime now) {
  const auto parsed = page::parse_shifts(times);
  if (!parsed) return "error: " + parsed.error().message;
  const auto found = page::shift_at(now, *parsed, MiddleEurope());
  return to_text(found.begin).substr(5, 11) + " - " + to_text(found.end).substr(5, 11);
}

}  // namespace

TEST_CASE("page: a shift begins at midnight of the zone unless it is said otherwise") {
  CHECK(shift("", utc(2026, 11, 30, 15)) == "11-29T23:00 - 11-30T23:00");
  CHECK(shift("", utc(2026, 11, 29, 23)) == "11-29T23:00 - 11-30T23:00");
  CHECK(shift("", utc(2026, 11, 29, 22, 59)) == "11-28T23:00 - 11-29T23:00");
}

TEST_CASE("page: shifts of a day, and the one over midnight") {
  const std::string three = "06:00,14:00,22:00";
  CHECK(shift(three, utc(2026, 11, 30, 5)) == "11-30T05:00 - 11-30T13:00");
  CHECK(shift(three, utc(2026, 11, 30, 12, 59)) == "11-30T05:00 - 11-30T13:00");
  CHECK(shift(three, utc(2026, 11, 30, 13)) == "11-30T13:00 - 11-30T21:00");
  CHECK(shift(three, utc(2026, 11, 30, 22, 30)) == "11-30T21:00 - 12-01T05:00");
  CHECK(shift(three, utc(2026, 12, 1, 3)) == "11-30T21:00 - 12-01T05:00");
  CHECK(shift("22:00,06:00,06:00", utc(2026, 12, 1, 3)) == "11-30T21:00 - 12-01T05:00");
  CHECK(shift("12:00", utc(2026, 12, 1, 3)) == "11-30T11:00 - 12-01T11:00");
}

TEST_CASE("page: a shift is an hour longer or shorter where clocks are changed") {
  // 25 hours and 23 hours.
  CHECK(shift("", utc(2026, 10, 25, 22, 30)) == "10-24T22:00 - 10-25T23:00");
  CHECK(shift("", utc(2026, 10, 25, 23)) == "10-25T23:00 - 10-26T23:00");
  CHECK(shift("", utc(2026, 3, 28, 23, 30)) == "03-28T23:00 - 03-29T22:00");
  CHECK(shift("", utc(2026, 3, 29, 22, 30)) == "03-29T22:00 - 03-30T22:00");
  // The night shift.
  CHECK(shift("06:00,22:00", utc(2026, 10, 25, 1, 30)) == "10-24T20:00 - 10-25T05:00");
  CHECK(shift("06:00,22:00", utc(2026, 3, 29, 1, 30)) == "03-28T21:00 - 03-29T04:00");
  // One that begins in the hour that is there twice begins in the first of the two.
  CHECK(shift("02:30", utc(2026, 10, 25, 1, 45)) == "10-25T00:30 - 10-26T01:30");
}

TEST_CASE("page: what is no list of times") {
  for (const char* text : {"6", "6:00", "24:00", "06:60", "06:00,", ",", "06-00", "06:00 14:00"}) {
    CAPTURE(text);
    CHECK(shift(text, {}).starts_with("error: "));
  }
}
