#include "spindle/report/record.hpp"

#include <doctest/doctest.h>

#include <chrono>

using namespace std::chrono_literals;
using spindle::Decimal;
using spindle::WallTime;
using spindle::report::Cell;
using spindle::report::Pairs;
using spindle::report::Record;
using spindle::report::Texts;
using spindle::report::to_text;
using spindle::report::Words;

namespace {

WallTime at(std::chrono::year_month_day date, std::chrono::milliseconds time_of_day) {
  return std::chrono::sys_days(date) + time_of_day;
}

}  // namespace

TEST_CASE("a time is shown in UTC with milliseconds") {
  using std::chrono::November;
  struct Row {
    WallTime time;
    std::string text;
  };
  const Row rows[] = {
      {at(std::chrono::year(2026) / November / 22, 10h + 15min + 30s + 123ms),
       "2026-11-22T10:15:30.123Z"},  // contract, section 3
      {WallTime{}, "1970-01-01T00:00:00.000Z"},
      {WallTime(-1ms), "1969-12-31T23:59:59.999Z"},
      {at(std::chrono::year(2024) / 2 / 29, 23h + 59min + 59s + 7ms), "2024-02-29T23:59:59.007Z"},
      {WallTime(951'782'400'000ms), "2000-02-29T00:00:00.000Z"},  // date -u -d @951782400
  };
  for (const Row& row : rows) CHECK(to_text(row.time) == row.text);
}

TEST_CASE("a cell's plain text") {
  struct Row {
    Cell cell;
    std::string text;
  };
  const Row rows[] = {
      {std::monostate{}, ""},
      {Decimal(1000, -2), "10.00"},
      {Decimal(-5, -2), "-0.05"},
      {std::string("BMT 40"), "BMT 40"},
      {true, "true"},
      {false, "false"},
      {Words{271, 0, 65535}, "271 0 65535"},
      {Words{}, ""},
      {Texts{"doga-bm", "doga-bmt"}, "doga-bm, doga-bmt"},
      {Pairs{{"0", "off"}, {"1", "on"}}, "0=off, 1=on"},
      {Pairs{}, ""},
  };
  for (const Row& row : rows) CHECK(to_text(row.cell) == row.text);
}

TEST_CASE("a record finds its first field of a key") {
  const Record record{.type = "value",
                      .target = "station3",
                      .time = {},
                      .fields = {{"name", std::string("preset.1.speed")},
                                 {"value", Decimal(7), "7 rpm"},
                                 {"value", Decimal(8)}}};
  REQUIRE(record.find("value") != nullptr);
  CHECK(record.find("value")->shown == "7 rpm");
  CHECK(record.find("unit") == nullptr);
  CHECK(record.find("") == nullptr);
}
