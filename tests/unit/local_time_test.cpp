#include "spindle/base/local_time.hpp"

#include <doctest/doctest.h>

#include <functional>
#include <initializer_list>
#include <string>
#include <utility>

#include "spindle/base/duration.hpp"

using namespace spindle;
using namespace std::chrono_literals;

namespace {

WallTime utc(int year, unsigned month, unsigned day, int hour = 0, int minute = 0, int second = 0) {
  return std::chrono::sys_days(std::chrono::year(year) / std::chrono::month(month) /
                               std::chrono::day(day)) +
         std::chrono::hours(hour) + std::chrono::minutes(minute) + std::chrono::seconds(second);
}

using Offset = std::function<std::chrono::seconds(WallTime)>;

class ZoneClock final : public Clock {
 public:
  ZoneClock(WallTime now, Offset offset) : now_(now), offset_(std::move(offset)) {}
  [[nodiscard]] TimePoint now() const override { return {}; }
  [[nodiscard]] WallTime wall() const override { return now_; }
  [[nodiscard]] std::chrono::seconds utc_offset(WallTime time) const override {
    return offset_(time);
  }
  Result<void> sleep_until(TimePoint /*deadline*/) override { return {}; }

 private:
  WallTime now_;
  Offset offset_;
};

/// Central Europe in 2026: two hours ahead from March 29 to October 25, 01:00 UTC.
std::chrono::seconds middle_europe(WallTime time) {
  const bool summer = time >= utc(2026, 3, 29, 1) && time < utc(2026, 10, 25, 1);
  return summer ? 2h : 1h;
}
std::chrono::seconds london_in_winter(WallTime /*time*/) { return {}; }

const WallTime now = utc(2026, 11, 30, 15, 30, 5) + 250ms;

std::string read(const std::string& text, const Offset& offset = middle_europe, WallTime at = now) {
  const auto time = parse_time(text, ZoneClock(at, offset));
  return time ? to_text(*time) : "error: " + time.error().message;
}

}  // namespace

TEST_CASE("local_time: times as people write them") {
  const std::initializer_list<std::pair<const char*, const char*>> cases = {
      {"now", "2026-11-30T15:30:05.250Z"},
      {"today", "2026-11-29T23:00:00.000Z"},
      {"yesterday", "2026-11-28T23:00:00.000Z"},
      {"yesterday 14:00", "2026-11-29T13:00:00.000Z"},
      {"today 6:05", "2026-11-30T05:05:00.000Z"},
      {"14:00", "2026-11-30T13:00:00.000Z"},
      {"14:00:05", "2026-11-30T13:00:05.000Z"},
      {"14:00:05.12", "2026-11-30T13:00:05.120Z"},
      {"2h", "2026-11-30T13:30:05.250Z"},
      {"2h ago", "2026-11-30T13:30:05.250Z"},
      {"30min", "2026-11-30T15:00:05.250Z"},
      {"90s", "2026-11-30T15:28:35.250Z"},
      {"1.5h", "2026-11-30T14:00:05.250Z"},
      {"3d", "2026-11-27T15:30:05.250Z"},
      {"2w", "2026-11-16T15:30:05.250Z"},
      {"2026-11-30", "2026-11-29T23:00:00.000Z"},
      {"2026-07-01", "2026-06-30T22:00:00.000Z"},
      {"2026-11-30 14:00", "2026-11-30T13:00:00.000Z"},
      {"2026-11-30T14:00", "2026-11-30T13:00:00.000Z"},
      {"2026-11-30T14:00:05.123456Z", "2026-11-30T14:00:05.123Z"},
      {"2026-11-30T14:00:05+05:30", "2026-11-30T08:30:05.000Z"},
      {"2026-11-30 14:00 -0100", "2026-11-30T15:00:00.000Z"},
      {"2026-11-30T14:00+01", "2026-11-30T13:00:00.000Z"},
      {"14:00Z", "2026-11-30T14:00:00.000Z"},
      {"2024-02-29", "2024-02-28T23:00:00.000Z"},
  };
  for (const auto& [text, expected] : cases) {
    CAPTURE(text);
    CHECK(read(text) == expected);
  }
  CHECK(read("2026-11-30 14:00", london_in_winter) == "2026-11-30T14:00:00.000Z");
  // Behind midnight here it is still the day before in UTC.
  CHECK(read("today", middle_europe, utc(2026, 11, 29, 23, 30)) == "2026-11-29T23:00:00.000Z");
}

TEST_CASE("local_time: the days on which clocks are changed") {
  CHECK(read("2026-03-29 01:59") == "2026-03-29T00:59:00.000Z");
  CHECK(read("2026-03-29 02:30") == "2026-03-29T01:30:00.000Z");  // there is none: as before
  CHECK(read("2026-03-29 03:00") == "2026-03-29T01:00:00.000Z");
  CHECK(read("2026-10-25 01:59") == "2026-10-24T23:59:00.000Z");
  CHECK(read("2026-10-25 02:30") == "2026-10-25T00:30:00.000Z");  // there are two: the first one
  CHECK(read("2026-10-25 03:00") == "2026-10-25T02:00:00.000Z");
  CHECK(read("2026-10-25") == "2026-10-24T22:00:00.000Z");
  CHECK(read("2026-10-26") == "2026-10-25T23:00:00.000Z");
  // Such a day has 25 hours, and "yesterday" is not 24 hours ago.
  CHECK(read("yesterday", middle_europe, utc(2026, 10, 26, 12)) == "2026-10-24T22:00:00.000Z");
  CHECK(read("24h", middle_europe, utc(2026, 10, 25, 12)) == "2026-10-24T12:00:00.000Z");
}

TEST_CASE("local_time: what is no time is told with examples") {
  for (const char* text : {"",
                           " ",
                           "tomorrow",
                           "2",
                           "2m",
                           "-2h",
                           "2h ago ago",
                           "ago",
                           "24:00",
                           "14",
                           "14:",
                           "14:0",
                           "14:60",
                           "14:00:60",
                           "14:00:05.",
                           "2026-11-31",
                           "2026-02-29",
                           "2026-13-01",
                           "26-11-30",
                           "2026-11-3",
                           "2026-11-30 ",
                           "2026-11-30T",
                           "2026-11-30 14",
                           "2026-11-30x14:00",
                           "2026-11-30T14:00+1",
                           "2026-11-30T14:00+24:00",
                           "2026-11-30T14:00Zx",
                           "todays",
                           "99999999999999999999h",
                           "999999w",
                           "1..5h",
                           "."}) {
    CAPTURE(text);
    const auto time = parse_time(text, ZoneClock(now, middle_europe));
    REQUIRE_FALSE(time.has_value());
    CHECK(time.error().code == Errc::usage);
    CHECK(time.error().message == "'" + std::string(text) + "' is not a time");
    CHECK(time.error().hint.find("2026-11-30T14:00:00Z") != std::string::npos);
  }
}

TEST_CASE("local_time: shown as the clocks of this computer do, with their zone") {
  const ZoneClock clock(now, middle_europe);
  CHECK(to_local_text(now, clock) == "2026-11-30 16:30:05.250+01:00");
  CHECK(to_local_text(utc(2026, 7, 1), clock) == "2026-07-01 02:00:00.000+02:00");
  CHECK(to_local_text(now, ZoneClock(now, london_in_winter)) == "2026-11-30 15:30:05.250+00:00");
  CHECK(to_local_text(now, ZoneClock(now, [](WallTime) { return std::chrono::seconds(-12600); })) ==
        "2026-11-30 12:00:05.250-03:30");
}

TEST_CASE("local_time: what is shown is read as the same time") {
  const ZoneClock clock(now, middle_europe);
  for (const WallTime time : {now, utc(2026, 10, 25, 0, 30), utc(2026, 10, 25, 1, 30),
                              utc(2026, 3, 29, 0, 59), utc(2026, 3, 29, 1)}) {
    CHECK(parse_time(to_local_text(time, clock), clock).value() == time);
  }
}
