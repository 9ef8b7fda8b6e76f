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

TEST_CASE("a record is read from the JSON that was made of it") {
  const WallTime time = at(std::chrono::year(2026) / 11 / 30, 14h);
  const Record record{.type = "link",
                      .target = "station \"3\"",
                      .time = time,
                      .fields = {{"state", std::string("lost")},
                                 {"attempt", Decimal(3)},
                                 {"torque", Decimal(-271, -2)},
                                 {"none", Cell()},
                                 {"here", true},
                                 {"gone", false},
                                 {"raw", Words{0, 65535}},
                                 {"nothing", Words{}},
                                 {"texts", Texts{"a,b", "]"}},
                                 {"labels", Pairs{{"0", "off"}, {"1", "\xc3\xa4"}}},
                                 {"message", std::string("\x1b[2J\"\\\r\n\t\x7f\xe2\x80\xae"
                                                         "\xf0\x9f\x94\xa9\xf3\xa0\x81\x81")}}};
  const std::string json = spindle::report::to_json(record);
  const auto read = spindle::report::record_of(json, time);
  REQUIRE(read.has_value());
  CHECK(read->type == "link");
  CHECK(read->target == "station \"3\"");
  CHECK(read->find("message")->cell == record.find("message")->cell);
  CHECK(spindle::report::to_json(*read) == json);
  const std::string of_none = spindle::report::to_json({"trim", "", time, {}});
  CHECK(spindle::report::to_json(spindle::report::record_of(of_none, time).value()) == of_none);
}

TEST_CASE("what is no record is read as none") {
  for (const char* json :
       {"", "{", "{}", "[]", R"({"type":"a")", R"({"type":"a"}x)", R"({"type":1})", R"({"a":1})",
        R"({"type":"a","b":})", R"({"type":"a","b":1e3})", R"({"type":"a","b":"\x"})",
        R"({"type":"a","b":"\u12"})", R"({"type":"a","b":[1,"x"]})", R"({"type":"a","b":{"c":1}})",
        R"({"type":"a",})", R"({"type":"a","b":"c)", R"({"type":"a","b":"c\)"}) {
    CAPTURE(json);
    CHECK_FALSE(spindle::report::record_of(json, WallTime{}).has_value());
  }
}
