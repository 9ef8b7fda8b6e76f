#include "device/bad_frames.hpp"

#include <doctest/doctest.h>

#include <chrono>
#include <string>

using namespace spindle;
using namespace std::chrono_literals;
using device::BadFrames;

namespace {

link::Spontaneous frame(std::uint8_t function) {
  return {.pdu = {.function = function, .data = {}}, .arrival = {}, .wall = {}};
}

std::string words(const std::optional<BadFrames::News>& news) { return news ? news->reason : ""; }

const std::string behind = " that came unasked could not be understood; the last has function ";

}  // namespace

TEST_CASE("the first frame is told at once, and those behind it together") {
  BadFrames frames;
  const TimePoint begin = TimePoint() + 1h;
  CHECK(frames.next_due() == TimePoint::max());
  CHECK(words(frames.note(frame(0x65), "it is too short", begin)) ==
        "1 frame" + behind + "0x65, but it is too short");
  CHECK(frames.next_due() == TimePoint::max());
  CHECK_FALSE(frames.note(frame(0x65), "it is too long", begin + 10s));
  CHECK_FALSE(frames.note(frame(0x66), "it is cut", begin + 20s));
  CHECK(frames.next_due() == begin + 1min);
  CHECK_FALSE(frames.due(begin + 59s));
  CHECK(words(frames.due(begin + 1min)) == "2 frames" + behind + "0x66, but it is cut");
  CHECK_FALSE(frames.due(begin + 2min));
  CHECK_FALSE(frames.rest());
}

TEST_CASE("what waits at the end is told, too") {
  BadFrames frames;
  const TimePoint begin = TimePoint() + 1h;
  REQUIRE(frames.note(frame(0x65), "it is too short", begin));
  CHECK_FALSE(frames.note(frame(0x65), "it is too long", begin));
  CHECK(words(frames.rest()) == "1 frame" + behind + "0x65, but it is too long");
  CHECK_FALSE(frames.rest());
}
