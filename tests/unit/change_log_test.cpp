#include "spindle/files/change_log.hpp"

#include <doctest/doctest.h>

#include <nlohmann/json.hpp>

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
                      .id = "1-a-1",
                      .unit = "N.m",
                      .undoes = "1-a-0"};
  CHECK(render_change(change) ==
        "{\"schema\":\"spindle/1\",\"type\":\"changed\",\"time\":\"2026-11-22T10:15:30.123Z\","
        "\"user\":\"anna\",\"command\":\"set\",\"target\":\"station3\",\"serial\":\"1021100042\","
        "\"name\":\"preset.1.target-torque\",\"register\":2,\"old\":2.71,\"new\":3.10,"
        "\"result\":\"written\",\"id\":\"1-a-1\",\"unit\":\"N.m\",\"undoes\":\"1-a-0\"}\n");
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
        "null,\"unit\":null}\n");
}

TEST_CASE("another reader of JSON finds the texts as they were") {
  const Change change{.time = "t",
                      .user = "\xe2\x80\xae\"\\\t\x7f",
                      .command = "restore",
                      .target = "\xf0\x9f\x94\xa9 3",
                      .serial = "7",
                      .name = "a",
                      .old_value = Decimal(4294967295),
                      .result = "written"};
  const auto line = nlohmann::json::parse(render_change(change));
  CHECK(line.at("user") == change.user);
  CHECK(line.at("target") == change.target);
  CHECK(line.at("old") == 4294967295);
}
