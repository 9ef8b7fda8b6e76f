#include "spindle/base/duration.hpp"

#include <doctest/doctest.h>

using namespace spindle;
using namespace std::chrono_literals;

TEST_CASE("durations are read exactly") {
  struct Case {
    std::string_view text;
    Duration duration;
  };
  for (const auto& row : {
           Case{"0", 0ns},
           Case{"0s", 0ns},
           Case{"500ms", 500ms},
           Case{"2s", 2s},
           Case{"1.5s", 1500ms},
           Case{".5s", 500ms},
           Case{"5min", 5min},
           Case{"1h", 1h},
           Case{"5us", 5us},
           Case{"0.001us", 1ns},
           Case{"5.5ms", 5500us},
           Case{"720h", 720h},
       }) {
    const auto& [text, duration] = row;
    CAPTURE(row.text);
    const auto parsed = parse_duration(text);
    REQUIRE(parsed);
    CHECK(*parsed == duration);
  }
}

TEST_CASE("what is not a duration is a usage error that shows how to write one") {
  for (const std::string_view text :
       {"", "1", "s", "ms", "-1s", "+1s", "1 s", " 1s", "1s ", "1m", "1S", "1.s", "1e3s", "0x1s",
        "1s2ms", "0.0001us", "99999999999999999999s", "999999999999999999h"}) {
    CAPTURE(text);
    const auto parsed = parse_duration(text);
    REQUIRE_FALSE(parsed);
    CHECK(parsed.error().code == Errc::usage);
    CHECK(message_of(parsed.error()) == "'" + std::string(text) + "' is not a duration");
    CHECK(hint_of(parsed.error()).find("500ms") != std::string::npos);
  }
}

TEST_CASE("thirty days are the limit") {
  const auto parsed = parse_duration("720.001h");
  REQUIRE_FALSE(parsed);
  CHECK(parsed.error().code == Errc::usage);
  CHECK(message_of(parsed.error()) == "'720.001h' is longer than 30 days");
}

TEST_CASE("text uses the largest unit that is exact") {
  struct Case {
    Duration duration;
    std::string_view text;
  };
  for (const auto& row : {
           Case{0ns, "0s"},
           Case{1s, "1s"},
           Case{1500ms, "1500ms"},
           Case{5min, "5min"},
           Case{90s, "90s"},
           Case{24h, "24h"},
           Case{250us, "250us"},
           Case{5500us, "5500us"},
           Case{1500ns, "1.5us"},
           Case{1ns, "0.001us"},
       }) {
    const auto& [duration, text] = row;
    CAPTURE(row.text);
    CHECK(to_text(duration) == text);
    const auto again = parse_duration(text);
    REQUIRE(again);
    CHECK(*again == duration);
  }
}
