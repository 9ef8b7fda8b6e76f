#include "spindle/files/change_log.hpp"

#include <doctest/doctest.h>

#include <string>
#include <utility>
#include <vector>

using namespace spindle;
using files::Change;
using files::render_change;

TEST_CASE("a change is one JSON line with exact numbers") {
  const Change change{.time = "2026-11-22T10:15:30.123Z",
                      .user = "anna",
                      .command = "set",
                      .target = "station3",
                      .serial = "1021100042",
                      .name = "preset.1.target-torque",
                      .register_address = 2,
                      .old_value = Decimal(271, -2),
                      .new_value = Decimal(310, -2),
                      .result = "written",
                      .id = "1-a-1"};
  CHECK(render_change(change) ==
        "{\"schema\":\"spindle/1\",\"type\":\"changed\",\"time\":\"2026-11-22T10:15:30.123Z\","
        "\"user\":\"anna\",\"command\":\"set\",\"target\":\"station3\",\"serial\":\"1021100042\","
        "\"name\":\"preset.1.target-torque\",\"register\":2,\"old\":2.71,\"new\":3.10,"
        "\"result\":\"written\",\"id\":\"1-a-1\"}\n");
}

TEST_CASE("what is not known is null, and no text breaks the line") {
  const Change change{.time = "t",
                      .user = "a\"b\\c\n\x01\xff",
                      .command = "do",
                      .target = "caf\xc3\xa9",
                      .serial = {},
                      .name = "start",
                      .result = "sent"};
  CHECK(render_change(change) ==
        "{\"schema\":\"spindle/1\",\"type\":\"changed\",\"time\":\"t\",\"user\":\"a\\\"b\\\\c\\n"
        "\\u0001\xef\xbf\xbd\",\"command\":\"do\",\"target\":\"caf\xc3\xa9\",\"serial\":null,"
        "\"name\":\"start\",\"register\":null,\"old\":null,\"new\":null,\"result\":\"sent\",\"id\":"
        "null}\n");
}

TEST_CASE("a line that a crash cut off is left out and named, and those around it are read") {
  const Change whole{.time = "t",
                     .user = "anna",
                     .command = "set",
                     .target = "station3",
                     .serial = "7",
                     .name = "a",
                     .register_address = 2,
                     .old_value = Decimal(-271, -2),
                     .new_value = Decimal(4294967295),
                     .result = "written",
                     .id = "1-a-1"};
  const std::string line = render_change(whole);
  const std::string half = line.substr(0, line.size() / 2);
  const auto records = files::read_changes(line + half + "\n" + line + "[]\n\n{}\n" + half);
  CHECK(records.broken == std::vector<std::size_t>{2, 4, 6, 7});
  REQUIRE(records.changes.size() == 2);
  for (const Change& change : records.changes) CHECK(render_change(change) == line);
}

TEST_CASE("a record without a result is found by its id, its tool and its name") {
  const auto record = [](std::string id, std::string target, std::string result) {
    Change change;
    change.id = std::move(id);
    change.target = std::move(target);
    change.name = "a";
    change.result = std::move(result);
    return change;
  };
  const std::string begun(files::begun);
  const auto open = files::without_result({record("", "x", "written"), record("1", "x", begun),
                                           record("1", "y", begun), record("1", "x", "written"),
                                           record("2", "x", begun), record("2", "x", "unknown")});
  REQUIRE(open.size() == 1);
  CHECK(open.front().target == "y");
}
