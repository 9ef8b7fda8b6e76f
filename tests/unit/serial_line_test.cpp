#include "spindle/sim/serial_line.hpp"

#include <doctest/doctest.h>

#include "hex.hpp"

using namespace spindle;
using namespace spindle::sim;
using namespace std::chrono_literals;
using spindle::test::hex;

namespace {
constexpr TimePoint start = TimePoint(1h);
constexpr Duration gap = 5500us;
constexpr Duration character = 1146us;
}  // namespace

TEST_CASE("line: silence ends a burst, bytes take their time") {
  SerialLine line(gap, character);
  CHECK_FALSE(line.silent_at());
  CHECK_FALSE(line.take(start));
  line.hear(hex("01 02 03"), start);
  CHECK(line.silent_at() == start + 3 * character + gap);
  CHECK_FALSE(line.take(start + 3 * character + gap - 1ns));
  const auto burst = line.take(start + 1s);
  REQUIRE(burst);
  CHECK(burst->bytes == hex("01 02 03"));
  CHECK(burst->timing == Burst::Timing::in_time);
  CHECK(burst->end == start + 3 * character + gap);  // whenever it is looked at
  CHECK_FALSE(line.take(start + 1s));
  CHECK_FALSE(line.silent_at());
}

TEST_CASE("line: what comes within the gap goes on with the burst") {
  SerialLine line(gap, Duration::zero());
  line.hear(hex("01"), start);
  line.hear(hex("02"), start + gap - 1us);
  CHECK(line.silent_at() == start + 2 * gap - 1us);
  const auto burst = line.take(start + 1s);
  REQUIRE(burst);
  CHECK(burst->bytes == hex("01 02"));
}

TEST_CASE("line: bytes that wait for the line follow each other") {
  SerialLine line(gap, character);
  line.hear(hex("01 02"), start);
  line.hear(hex("03"), start + 1us);
  CHECK(line.silent_at() == start + 3 * character + gap);
}

TEST_CASE("line: a burst that begins within the gap is too early, in either direction") {
  struct Row {
    Duration after;
    Burst::Timing timing;
  };
  for (const Row& row :
       {Row{0us, Burst::Timing::too_early}, Row{gap - 1us, Burst::Timing::too_early},
        Row{gap, Burst::Timing::in_time}, Row{1s, Burst::Timing::in_time}}) {
    CAPTURE(row.after.count());
    SerialLine answered(gap, Duration::zero());
    answered.spoke(start);
    answered.hear(hex("01"), start + row.after);
    const auto burst = answered.take(start + 2s);
    CHECK(burst->timing == row.timing);
    CHECK(burst->silence == (row.timing == Burst::Timing::too_early ? row.after : 0us));

    // Behind the client's own last byte, too: a broadcast, or a query that was not heard itself.
    if (row.after < gap) continue;  // it would go on with the same burst
    SerialLine asked(gap, Duration::zero());
    asked.hear(hex("01"), start);
    REQUIRE(asked.take(start + gap));
    asked.hear(hex("02"), start + row.after);
    CHECK(asked.take(start + 2s)->timing == row.timing);
  }
  SerialLine busy(gap, Duration::zero());
  busy.spoke(start);
  busy.hear(hex("01"), start + 2ms);  // too early, and makes the next one too early
  REQUIRE(busy.take(start + 2ms + gap));
  busy.spoke(start + 8ms);
  busy.hear(hex("02"), start + 9ms);
  CHECK(busy.take(start + 1s)->timing == Burst::Timing::too_early);
}
