#include "spindle/device/event_tracker.hpp"

#include <doctest/doctest.h>

#include <vector>

using namespace spindle;
using device::EventTracker;
using device::Sequence;
using device::Tracked;
using namespace std::chrono_literals;

namespace {

/// A block with its number in front; `rest` tells two events of one number apart.
Registers block(std::uint16_t number, std::uint16_t rest = 7) {
  return {number, rest, static_cast<std::uint16_t>(number * 3U)};
}

Tracked track(EventTracker& tracker, std::uint16_t number, std::uint16_t rest = 7) {
  return tracker.track(number, block(number, rest));
}

struct Row {
  const char* what;
  std::uint16_t last;
  std::uint16_t number;
  Sequence novelty;
  std::uint32_t missed;
};

}  // namespace

TEST_CASE("the number of an event says what it is") {
  const std::vector<Row> rows = {
      {"the same again", 1962, 1962, Sequence::repeat, 0},
      {"one more", 1962, 1963, Sequence::next, 0},
      {"one was missed", 1962, 1964, Sequence::jump, 1},
      {"many were missed", 10, 60010, Sequence::jump, 59999},
      {"the last number", 65534, 65535, Sequence::next, 0},
      {"from the first number", 0, 1, Sequence::next, 0},
      {"behind the last number", 65535, 0, Sequence::wrap, 0},
      {"behind the last number, some missed", 65530, 4, Sequence::wrap, 9},
      {"as far as a wrap is believed", 65535, 1023, Sequence::wrap, 1023},
      {"farther", 65535, 1024, Sequence::restart, 0},
      {"as early as a wrap is believed", 64512, 0, Sequence::wrap, 1023},
      {"earlier", 64511, 0, Sequence::restart, 0},
      {"a restarted tool", 1962, 1, Sequence::restart, 0},
      {"a restarted tool that had few events", 2, 1, Sequence::restart, 0},
  };
  for (const Row& row : rows) {
    CAPTURE(row.what);
    EventTracker tracker;
    CHECK(track(tracker, row.last).novelty == Sequence::baseline);
    const Tracked tracked = track(tracker, row.number);
    CHECK(tracked.novelty == row.novelty);
    CHECK(tracked.missed == row.missed);
    CHECK(tracked.is_new() == (row.novelty != Sequence::repeat));
    CHECK(tracker.last() == row.number);
  }
}

TEST_CASE("the first event is an old one, unless its number was read before") {
  EventTracker fresh;
  CHECK_FALSE(fresh.last());
  CHECK_FALSE(track(fresh, 1962).is_new());
  CHECK(fresh.last() == 1962);

  EventTracker informed;
  informed.set_baseline(1961);
  CHECK(informed.last() == 1961);
  CHECK(track(informed, 1962).novelty == Sequence::next);
}

TEST_CASE("a late repeat of an older event is no restart") {
  EventTracker tracker;
  tracker.set_baseline(99);
  for (std::uint16_t number = 100; number < 116; ++number) {
    CHECK(track(tracker, number).novelty == Sequence::next);
  }
  for (std::uint16_t number = 100; number < 116; ++number) {
    CAPTURE(number);
    CHECK(track(tracker, number).novelty == Sequence::repeat);
    CHECK(tracker.last() == 115);
  }
  CHECK(track(tracker, 116).novelty == Sequence::next);

  SUBCASE("an older number with other registers is another event") {
    CHECK(track(tracker, 110, 8).novelty == Sequence::restart);
  }
  SUBCASE("a new connection brings nothing late") {
    tracker.look_again(1s);
    CHECK(track(tracker, 110).novelty == Sequence::restart);
    CHECK(track(tracker, 111).novelty == Sequence::next);
  }
}

TEST_CASE("a late repeat of the event before the first is no restart") {
  EventTracker tracker;
  tracker.set_baseline(1961);
  CHECK(track(tracker, 1961).novelty == Sequence::repeat);  // read behind its number
  CHECK(track(tracker, 1962).novelty == Sequence::next);
  CHECK(track(tracker, 1961).novelty == Sequence::repeat);
  CHECK(track(tracker, 1963).novelty == Sequence::next);
}

TEST_CASE("the last number with other registers is another event: the tool counts anew") {
  EventTracker tracker;
  tracker.set_baseline(1962);
  CHECK(track(tracker, 1962, 8).novelty == Sequence::repeat);  // whose registers were not known yet
  CHECK(track(tracker, 1962, 8).novelty == Sequence::repeat);
  SUBCASE("on the same connection") {}
  SUBCASE("on another one") { tracker.look_again(1s); }
  CHECK(track(tracker, 1962, 9).novelty == Sequence::restart);
  CHECK(track(tracker, 1963, 9).novelty == Sequence::next);
}

TEST_CASE("a number that a tool can have counted anew to while it was not read is doubtful") {
  struct Unseen {
    const char* what;
    std::uint16_t last;
    Duration time;
    std::uint16_t number;
    Sequence novelty;
    std::uint32_t missed;
  };
  const std::vector<Unseen> rows = {
      {"just past the last, soon after power-on", 20, 1s, 21, Sequence::doubtful, 0},
      {"farther past it", 20, 1s, 30, Sequence::doubtful, 0},
      {"nothing happened", 20, 1s, 20, Sequence::repeat, 0},
      {"a number that takes a day to count to", 1961, 20s, 1962, Sequence::next, 0},
      {"the same after a night", 1961, 12h, 1962, Sequence::doubtful, 0},
      {"a count of what was missed", 1961, 20s, 1965, Sequence::jump, 3},
      {"as far as a tool is believed to come", 10, 10s, 356, Sequence::doubtful, 0},
      {"farther than that", 10, 10s, 357, Sequence::jump, 346},
      {"over the end of the counter, or anew", 65530, 1s, 3, Sequence::doubtful, 0},
      {"smaller: anew for certain", 1961, 1s, 4, Sequence::restart, 0},
  };
  for (const Unseen& row : rows) {
    CAPTURE(row.what);
    EventTracker tracker;
    track(tracker, row.last);
    tracker.look_again(row.time);
    const Tracked tracked = track(tracker, row.number);
    CHECK(tracked.novelty == row.novelty);
    CHECK(tracked.missed == row.missed);
    CHECK(tracked.is_new() == (row.novelty != Sequence::repeat));
    // What comes behind it was pushed as it happened.
    CHECK(track(tracker, static_cast<std::uint16_t>(row.number + 1)).novelty == Sequence::next);
  }
}

TEST_CASE(
    "registers that are all zero come from a tool that was just switched on, not from a wrap") {
  EventTracker tracker;
  tracker.set_baseline(65530);
  const Registers zeros(3);
  CHECK(EventTracker::is_blank(zeros));
  CHECK_FALSE(EventTracker::is_blank(block(0)));
  CHECK(tracker.track(0, zeros).novelty == Sequence::restart);
  CHECK(tracker.track(0, zeros).novelty == Sequence::repeat);
  CHECK(track(tracker, 1).novelty == Sequence::next);
}

TEST_CASE("an event that was pushed in its longer form is a repeat when the usual one is read") {
  EventTracker tracker;
  tracker.set_baseline(7);
  const Registers whole = {8, 1, 2, 3};
  const Registers usual = {8, 1};
  CHECK(tracker.track(8, whole).novelty == Sequence::next);
  CHECK(tracker.track(8, usual).novelty == Sequence::repeat);
  CHECK(tracker.track(8, Registers{8, 2}).novelty == Sequence::restart);
}
