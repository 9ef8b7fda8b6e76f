#include "spindle/sim/raised.hpp"

#include <doctest/doctest.h>

#include <string>

using namespace spindle;
using namespace std::chrono_literals;

TEST_CASE("raised: a code is written as documents write it, with a time behind it or not") {
  struct Row {
    std::string text;
    unsigned code;
    Duration after;
  };
  for (const Row& row :
       {Row{"30h", 0x30, 0s}, Row{"0x30", 0x30, 0s}, Row{"48", 48, 0s}, Row{"8EH", 0x8E, 0s},
        Row{"85h@5s", 0x85, 5s}, Row{"110@1min", 110, 60s}}) {
    CAPTURE(row.text);
    const auto raised = sim::parse_raised(row.text, 0xFFFF);
    REQUIRE(raised);
    CHECK(raised->code == row.code);
    CHECK(raised->after == row.after);
  }
}

TEST_CASE("raised: what is no code or no time is refused") {
  for (const std::string text :
       {"", "h", "0", "00h", "300", "1FFh", "x", "30h@", "30h@5", "@5s", "-1"}) {
    CAPTURE(text);
    const auto raised = sim::parse_raised(text, 0xFF);
    REQUIRE_FALSE(raised);
    CHECK(raised.error().status() == ExitStatus::usage);
    CHECK_FALSE(hint_of(raised.error()).empty());
  }
}
