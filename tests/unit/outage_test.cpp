#include "spindle/sim/outage.hpp"

#include <doctest/doctest.h>

#include <string>
#include <vector>

using namespace spindle;
using namespace spindle::sim;
using namespace std::chrono_literals;

TEST_CASE("outage: every kind has help and reads back its own name") {
  for (const OutageHelp& help : outage_help()) {
    CAPTURE(help.syntax);
    const std::string name = help.syntax.substr(0, help.syntax.find('='));
    const auto outage = parse_outage(name + "=1500ms@every:1min");
    REQUIRE(outage.has_value());
    CHECK(to_text(outage->kind) == name);
    CHECK(outage->lasts == 1500ms);
    CHECK(outage->every == 1min);
    CHECK_FALSE(help.meaning.empty());
  }
  CHECK(outage_help().size() == static_cast<std::size_t>(OutageKind::other_client) + 1);
}

TEST_CASE("outage: what is no outage is refused with what would help") {
  struct Row {
    std::string text;
    std::string message;
    std::string hint;
  };
  const std::string form = "write it like sleep=3s@every:20s";
  const std::vector<Row> rows = {
      {"", "outage '': no such kind ''", form},
      {"slep=3s@every:20s", "outage 'slep=3s@every:20s': no such kind 'slep'",
       "did you mean 'sleep'?"},
      {"sleep", "outage 'sleep': how long and how often it happens is missing", form},
      {"sleep=3s", "outage 'sleep=3s': how long and how often it happens is missing", form},
      {"sleep@every:3s", "outage 'sleep@every:3s': how long and how often it happens is missing",
       form},
      {"roam=20s@every:20s",
       "outage 'roam=20s@every:20s': it must last some time, and less than the interval", form},
      {"roam=0@every:20s",
       "outage 'roam=0@every:20s': it must last some time, and less than the interval", form},
  };
  for (const Row& row : rows) {
    CAPTURE(row.text);
    const auto outage = parse_outage(row.text);
    REQUIRE_FALSE(outage.has_value());
    CHECK(outage.error().code == Errc::bad_value);
    CHECK(outage.error().message == row.message);
    CHECK(outage.error().hint == row.hint);
  }
  CHECK_FALSE(parse_outage("sleep=3@every:20s").has_value());
  CHECK_FALSE(parse_outage("sleep=3s@every:-1s").has_value());
}

TEST_CASE("outage: a schedule says what is under way and when it changes") {
  const TimePoint begin = TimePoint(100s);
  const OutageSchedule schedule({{OutageKind::sleep, 2s, 10s}, {OutageKind::roam, 5s, 20s}}, begin);
  struct Row {
    Duration after;
    std::optional<OutageKind> kind;
    Duration next;
  };
  const std::vector<Row> rows = {
      {0s, {}, 10s},
      {9999ms, {}, 10s},
      {10s, OutageKind::sleep, 12s},
      {11s, OutageKind::sleep, 12s},
      {12s, {}, 20s},
      {20s, OutageKind::sleep, 22s},
      {22s, OutageKind::roam, 25s},
      {25s, {}, 30s},
      {30s, OutageKind::sleep, 32s},
  };
  for (const Row& row : rows) {
    CAPTURE(row.after.count());
    CHECK(schedule.at(begin + row.after) == row.kind);
    CHECK(schedule.next_change(begin + row.after) == begin + row.next);
  }
  CHECK_FALSE(OutageSchedule({}, begin).at(begin + 1h).has_value());
  CHECK_FALSE(OutageSchedule({}, begin).next_change(begin).has_value());
}
