#include <doctest/doctest.h>

#include <memory>
#include <string>
#include <vector>

#include "spindle/catalogue/curve.hpp"
#include "spindle/device/event_source.hpp"
#include "support/rig.hpp"

using namespace spindle;
using namespace std::chrono_literals;
using catalogue::EventKind;
using device::EventGap;
using device::EventMode;
using device::EventSource;
using device::Standing;
using device::ToolCurve;
using device::ToolEvent;

namespace {

constexpr std::uint16_t output_register = 5350;

/// A screwdriver whose event block is only pushed, and what its source tells.
struct Bench : test::DeviceRig {
  Bench() : Rig(test::product("doga-gen2"), sim::DeviceOptions{}) {
    source = EventSource::make(profile, EventMode::declared, clock, [this](const auto& news) {
      if (const auto* event = std::get_if<ToolEvent>(&news)) events.push_back(*event);
      if (const auto* gap = std::get_if<EventGap>(&news)) gaps.push_back(*gap);
      if (const auto* curve = std::get_if<ToolCurve>(&news)) curves.push_back(*curve);
    });
    device = std::make_unique<device::Device>(open());
  }
  Result<void> attach(Duration unseen = 1s) { return source->attach(*device, unseen); }
  /// So many results, as far as they are sent.
  void happen(int times, EventKind kind = EventKind::fastening_ok) {
    for (int time = 0; time < times; ++time) {
      tool->happen(kind, clock.now());
      for (int step = 0; step < 50; ++step) {
        wait(20ms);
        source->handle_waiting();
      }
    }
  }
  [[nodiscard]] std::vector<std::uint16_t> numbers() const {
    std::vector<std::uint16_t> all;
    for (const ToolEvent& event : events) all.push_back(event.number.value_or(0));
    return all;
  }

  std::vector<ToolEvent> events = {};
  std::vector<EventGap> gaps = {};
  std::vector<ToolCurve> curves = {};
  std::unique_ptr<EventSource> source = nullptr;
  std::unique_ptr<device::Device> device = nullptr;
};

}  // namespace

TEST_CASE("pushed only: each form is one event with its curves, and nothing is read or polled") {
  Bench bench;
  REQUIRE(bench.attach());
  bench.wait(2s);
  bench.wire.requests.clear();
  bench.happen(4);
  CHECK(bench.numbers() == std::vector<std::uint16_t>{1, 2, 3, 4});
  CHECK(bench.gaps.empty());
  REQUIRE(bench.curves.size() == 4);
  for (std::size_t at = 0; at < bench.curves.size(); ++at) {
    CAPTURE(at);
    CHECK(bench.curves[at].number == at + 1);
    CHECK(bench.curves[at].is_whole);
    REQUIRE(bench.curves[at].channels.size() == 2);
    CHECK(catalogue::to_samples(bench.curves[at].channels[1]).size() == 400);
  }
  for (const ToolEvent& event : bench.events) CHECK(event.standing == Standing::result);
  CHECK(!bench.source->polls());
  CHECK(bench.wire.requests.empty());
  CHECK(!bench.source->caveat().empty());
}

TEST_CASE("pushed only: what comes at once may be old, and is told as such") {
  Bench bench;
  REQUIRE(bench.attach());
  bench.happen(1, EventKind::fastening_ng);
  REQUIRE(bench.events.size() == 1);
  CHECK(bench.events[0].standing == Standing::first);
}

TEST_CASE("pushed only: what was missed while there was no connection shows by the next number") {
  Bench bench;
  REQUIRE(bench.attach());
  bench.wait(2s);
  bench.happen(1, EventKind::fastening_ng);
  bench.device.reset();
  bench.tool->happen(EventKind::fastening_ng, bench.clock.now());
  bench.wait(5s);
  bench.device = std::make_unique<device::Device>(bench.open());
  REQUIRE(bench.attach(100ms));
  bench.happen(1, EventKind::fastening_ng);
  CHECK(bench.numbers() == std::vector<std::uint16_t>{1, 3});
  REQUIRE(bench.gaps.size() == 1);
  CHECK(bench.gaps[0].after == 1);
  CHECK(bench.gaps[0].before == 3);
}

TEST_CASE("pushed only: the last event of a record is not told again") {
  Bench bench;
  bench.source->recall(device::LastEvent{.number = 1, .block = std::nullopt, .unseen = 100ms});
  REQUIRE(bench.attach());
  bench.happen(1, EventKind::fastening_ng);
  CHECK(bench.events.empty());
  bench.happen(1, EventKind::fastening_ng);
  CHECK(bench.numbers() == std::vector<std::uint16_t>{2});
}

TEST_CASE("pushed only: output is renewed before three seconds are over, and switched off") {
  Bench bench;
  REQUIRE(bench.attach());
  const TimePoint armed = bench.clock.now();
  CHECK(bench.source->next_due() < armed + 3s);
  bench.clock.advance(3s);
  bench.wire.requests.clear();
  REQUIRE(bench.source->run_due([](const auto& request) { return request(); }));
  REQUIRE(bench.wire.writes().size() == 1);
  bench.source->disarm();
  const auto writes = bench.wire.writes();
  REQUIRE(writes.size() == 2);
  CHECK(writes[1] == test::Wire::Write(output_register, 0));
}
