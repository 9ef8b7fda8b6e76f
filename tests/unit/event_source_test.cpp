#include "spindle/device/event_source.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "support/rig.hpp"

using namespace spindle;
using namespace std::chrono_literals;
using catalogue::EventKind;
using device::EventGap;
using device::EventMode;
using device::EventOrigin;
using device::EventSource;
using device::ToolEvent;

namespace {

constexpr std::uint16_t flag_register = 294;
constexpr std::uint16_t block_register = 295;

std::uint16_t first_of(const modbus::Pdu& request) { return get_u16(request.data, 0); }

/// A tool by a profile of its own, and what its source of events tells.
struct Bench : test::DeviceRig {
  explicit Bench(const std::string& name, void (*change)(catalogue::EventSpec&) = nullptr)
      : Rig(changed(name, change), sim::DeviceOptions{}) {
    source = EventSource::make(profile, EventMode::declared, clock, [this](const auto& news) {
      if (const auto* event = std::get_if<ToolEvent>(&news)) events.push_back(*event);
      if (const auto* gap = std::get_if<EventGap>(&news)) gaps.push_back(*gap);
    });
  }
  static test::Product changed(const std::string& name, void (*change)(catalogue::EventSpec&)) {
    test::Product made = test::product(name);
    if (change != nullptr) change(*made.profile.events);
    return made;
  }

  Result<void> attach() {
    device = std::make_unique<device::Device>(open());
    return source->attach(*device, 1s);
  }
  void happen(EventKind kind = EventKind::fastening_ok) { tool->happen(kind, clock.now()); }
  /// The answers to the next so many readings that begin at this register are lost.
  void lose(std::uint16_t first, unsigned count) {
    wire.fate =
        test::next_meet(test::Fate::has_no_answer, count,
                        [first](const modbus::Pdu& request) { return first_of(request) == first; });
  }
  /// An interrupt comes instead of the answer to the next reading there.
  void interrupt_reading(std::uint16_t first) {
    lose(first, 1);
    wire.behind = [this, first](const modbus::Pdu& request) {
      if (first_of(request) == first) interrupt.raise(2);
    };
  }
  [[nodiscard]] std::vector<std::uint16_t> asked() const {
    std::vector<std::uint16_t> all;
    for (const auto& [at, request] : wire.requests) all.push_back(first_of(request));
    return all;
  }

  std::unique_ptr<device::Device> device = nullptr;
  std::vector<ToolEvent> events = {};
  std::vector<EventGap> gaps = {};
  std::unique_ptr<EventSource> source = nullptr;
};

}  // namespace

TEST_CASE("a source is made by the profile, and none where nothing is wanted or there") {
  Bench bench("kducer");
  CHECK(bench.source != nullptr);
  CHECK(EventSource::make(bench.profile, EventMode::none, bench.clock, {}) == nullptr);
  bench.profile.events.reset();
  CHECK(EventSource::make(bench.profile, EventMode::declared, bench.clock, {}) == nullptr);
}

TEST_CASE("flag: each result is told once, and nothing where there is none") {
  Bench bench("kducer");
  CHECK(bench.source->polls());
  CHECK(!bench.source->caveat().empty());
  REQUIRE(bench.attach());
  REQUIRE(bench.source->poll());
  CHECK(bench.events.empty());
  for (int i = 0; i < 3; ++i) {
    bench.happen();
    REQUIRE(bench.source->poll());
    REQUIRE(bench.source->poll());
  }
  CHECK(bench.events.size() == 3);
  CHECK(bench.events.front().source == EventOrigin::poll);
  CHECK(bench.gaps.empty());
}

TEST_CASE("flag: what waits when the watch begins is told") {
  Bench bench("kducer");
  bench.happen(EventKind::fastening_ng);
  REQUIRE(bench.attach());
  REQUIRE(bench.events.size() == 1);
  CHECK(bench.events.front().source == EventOrigin::catch_up);
  CHECK(bench.gaps.empty());
}

TEST_CASE("flag: the lost answer to its reading is never asked for again, the block is looked at") {
  Bench bench("kducer");
  REQUIRE(bench.attach());
  bench.wire.requests.clear();
  bench.happen();
  bench.lose(flag_register, 1);
  REQUIRE(bench.source->poll());
  CHECK(bench.asked() == std::vector<std::uint16_t>{flag_register, block_register});
  CHECK(bench.events.size() == 1);
  CHECK(bench.gaps.empty());
}

TEST_CASE("flag: where the block is the one before, a lost answer is a gap") {
  Bench bench("kducer");
  REQUIRE(bench.attach());
  bench.lose(flag_register, 1);
  REQUIRE(bench.source->poll());
  CHECK(bench.events.empty());
  REQUIRE(bench.gaps.size() == 1);
  CHECK(bench.gaps.front().missed == std::nullopt);
}

TEST_CASE("flag: a result that cannot be read is a gap, and is fetched on the next connection") {
  Bench bench("kducer");
  REQUIRE(bench.attach());
  bench.happen();
  bench.lose(block_register, 2);  // once more for the repetition
  CHECK(!bench.source->poll().has_value());
  REQUIRE(bench.gaps.size() == 1);
  CHECK(bench.gaps.front().reason.find("could not be read") != std::string::npos);
  CHECK(bench.events.empty());
  REQUIRE(bench.attach());
  CHECK(bench.gaps.size() == 2);  // what else happened meanwhile is not known
  REQUIRE(bench.events.size() == 1);
  CHECK(bench.events.front().source == EventOrigin::catch_up);
  REQUIRE(bench.attach());
  CHECK(bench.events.size() == 1);
}

TEST_CASE("flag: a result that comes before the one before it was read is one that is missed") {
  Bench bench("kducer");
  REQUIRE(bench.attach());
  bench.happen();
  bench.wire.behind = [&bench](const modbus::Pdu& request) {
    if (first_of(request) != flag_register) return;
    bench.wire.behind = {};
    bench.happen(EventKind::fastening_ng);
  };
  REQUIRE(bench.source->poll());
  CHECK(bench.events.size() == 1);
  CHECK(bench.gaps.empty());
  REQUIRE(bench.source->poll());
  CHECK(bench.events.size() == 1);
  REQUIRE(bench.gaps.size() == 1);
  CHECK(bench.gaps.front().missed == 1U);
}

TEST_CASE("flag: another tool is not compared with the one before") {
  Bench bench("kducer");
  REQUIRE(bench.attach());
  bench.source->forget();
  REQUIRE(bench.attach());
  CHECK(bench.gaps.empty());
}

TEST_CASE("flag: no device reads it but for its source") {
  Bench bench("kducer");
  bench.happen();
  REQUIRE(bench.attach());
  bench.wire.requests.clear();
  bench.happen();
  const auto all = bench.profile.select({});
  REQUIRE(all.has_value());
  REQUIRE(bench.device->read_each(*all, device::Limits::skip).has_value());
  const auto asked = bench.asked();
  CHECK(std::count(asked.begin(), asked.end(), flag_register) == 0);
  REQUIRE(bench.source->poll());
  CHECK(bench.events.size() == 2);
}

TEST_CASE("counter: what was missed is counted, and nothing is armed") {
  Bench bench("countermatic");
  CHECK(bench.source->polls());
  CHECK(bench.source->caveat().empty());
  CHECK(bench.source->next_due() == TimePoint::max());
  REQUIRE(bench.attach());
  bench.happen();
  REQUIRE(bench.source->poll());
  bench.happen();
  bench.happen(EventKind::fastening_ng);
  bench.happen();
  REQUIRE(bench.source->poll());
  CHECK(bench.events.size() == 2);
  REQUIRE(bench.gaps.size() == 1);
  CHECK(bench.gaps.front().missed == 2U);
}

TEST_CASE("counter: a block that is longer than a request is read in pieces") {
  Bench bench("countermatic");
  REQUIRE(bench.attach());
  bench.happen();
  REQUIRE(bench.source->poll());
  REQUIRE(bench.events.size() == 1);
  CHECK(bench.events.front().block.size() == 25);
  CHECK(bench.events.front().block.back() == 42);
}

TEST_CASE("push without arming: frames come by themselves, and nothing is switched on or off") {
  Bench bench("countermatic",
              [](catalogue::EventSpec& events) { events.model = catalogue::EventModel::push; });
  CHECK(!bench.source->polls());
  REQUIRE(bench.attach());
  CHECK(bench.source->next_due() == TimePoint::max());
  const std::size_t asked = bench.wire.requests.size();
  bench.happen();
  bench.happen(EventKind::fastening_ng);
  const auto frame = bench.device->session().next_spontaneous(bench.clock.now() + 10ms);
  REQUIRE((frame && *frame));
  bench.source->handle(**frame);
  bench.source->handle_waiting();
  REQUIRE(bench.events.size() == 2);
  CHECK(bench.events.front().source == EventOrigin::push);
  REQUIRE(bench.source->run_due([](const auto& request) { return request(); }));
  bench.source->disarm();
  CHECK(bench.wire.requests.size() == asked);
  CHECK(bench.gaps.empty());
}

namespace {

/// The event that stands in the tool, as a source that has no record of it tells it.
ToolEvent standing(Bench& bench) {
  bench.source->recall({});
  REQUIRE(bench.attach());
  REQUIRE(bench.events.size() == 1);
  return bench.events.front();
}

/// What a second source tells, of which a record says that this was the last event.
void go_on(Bench& bench, std::optional<device::LastEvent> last) {
  bench.events.clear();
  bench.gaps.clear();
  bench.source = EventSource::make(bench.profile, EventMode::declared, bench.clock,
                                   [&bench](const auto& news) {
                                     if (const auto* event = std::get_if<ToolEvent>(&news))
                                       bench.events.push_back(*event);
                                     if (const auto* gap = std::get_if<EventGap>(&news))
                                       bench.gaps.push_back(*gap);
                                   });
  bench.source->recall(std::move(last));
  REQUIRE(bench.attach());
}

}  // namespace

TEST_CASE("counter: where a record is kept, the event that stands there at first is told, too") {
  Bench bench("doga-bm");
  bench.happen();
  const ToolEvent first = standing(bench);
  CHECK(first.standing == device::Standing::first);
  CHECK(first.source == EventOrigin::catch_up);
  CHECK(bench.gaps.empty());
  bench.happen();
  const auto frame = bench.device->session().next_spontaneous(bench.clock.now() + 100ms);
  REQUIRE((frame && *frame));
  bench.source->handle(**frame);
  REQUIRE(bench.events.size() == 2);
  CHECK(bench.events.back().standing == device::Standing::result);
  CHECK(bench.events.back().number == *first.number + 1);
  REQUIRE(bench.attach());
  CHECK(bench.events.size() == 2);
}

TEST_CASE("counter: what happened since the last event of the record is a gap and one event") {
  Bench bench("doga-bm");
  bench.happen();
  const ToolEvent last = standing(bench);
  for (int i = 0; i < 3; ++i) bench.happen();
  go_on(bench, device::LastEvent{*last.number, last.block, 1s});
  REQUIRE(bench.gaps.size() == 1);
  CHECK(bench.gaps.front().missed == 2U);
  CHECK(bench.gaps.front().after == last.number);
  CHECK(bench.gaps.front().before == *last.number + 3);
  REQUIRE(bench.events.size() == 1);
  CHECK(bench.events.front().source == EventOrigin::catch_up);
  CHECK(bench.events.front().standing == device::Standing::result);
  CHECK(bench.events.front().number == *last.number + 3);
}

TEST_CASE("counter: the last event of the record is not told again") {
  Bench bench("doga-bm");
  bench.happen();
  const ToolEvent last = standing(bench);
  for (const bool with_block : {true, false}) {
    CAPTURE(with_block);
    go_on(bench, device::LastEvent{*last.number,
                                   with_block ? std::optional(last.block) : std::nullopt, 1s});
    CHECK(bench.events.empty());
    CHECK(bench.gaps.empty());
  }
}

TEST_CASE("counter: another event with the last number is one of a tool that was restarted") {
  Bench bench("doga-bm");
  bench.happen();
  const ToolEvent last = standing(bench);
  Registers other = last.block;
  ++other.back();
  go_on(bench, device::LastEvent{*last.number, other, 1s});
  REQUIRE(bench.gaps.size() == 1);
  CHECK(!bench.gaps.front().missed.has_value());
  CHECK(bench.gaps.front().sequence == device::Sequence::restart);
  REQUIRE(bench.events.size() == 1);
  CHECK(bench.events.front().standing == device::Standing::remembered);
}

TEST_CASE("counter: a tool that was not listened to for long may have begun to count anew") {
  Bench bench("doga-bm");
  bench.happen();
  const ToolEvent last = standing(bench);
  bench.happen();
  bench.happen();
  go_on(bench, device::LastEvent{*last.number, last.block, 24h});
  REQUIRE(bench.gaps.size() == 1);
  CHECK(!bench.gaps.front().missed.has_value());
  CHECK(bench.gaps.front().after == last.number);
  CHECK(bench.gaps.front().before == *last.number + 2);
  CHECK(bench.gaps.front().sequence == device::Sequence::doubtful);
}

TEST_CASE("flag: the last result of the record is compared with the one that stands there") {
  Bench bench("kducer");
  bench.happen();
  REQUIRE(bench.attach());
  REQUIRE(bench.events.size() == 1);
  const ToolEvent last = bench.events.front();
  go_on(bench, device::LastEvent{0, last.block, 1s});
  CHECK(bench.events.empty());
  REQUIRE(bench.gaps.size() == 1);  // it does not count, so what was missed is not known
  bench.happen(EventKind::fastening_ng);
  go_on(bench, device::LastEvent{0, last.block, 1s});
  CHECK(bench.events.size() == 1);
}

TEST_CASE("flag: an interrupt takes no result with it") {
  for (const std::uint16_t asked : {flag_register, block_register}) {
    CAPTURE(asked);
    Bench bench("kducer");
    REQUIRE(bench.attach());
    bench.happen();
    bench.interrupt_reading(asked);
    const auto polled = bench.source->poll();
    REQUIRE(!polled.has_value());
    CHECK(polled.error().code == Errc::interrupted);
    CHECK(bench.events.size() == 1);
    CHECK(bench.gaps.empty());
  }
}

TEST_CASE("flag: an interrupt is no gap where nothing happened") {
  Bench bench("kducer");
  REQUIRE(bench.attach());
  bench.interrupt_reading(flag_register);
  CHECK(!bench.source->poll().has_value());
  CHECK(bench.events.empty());
  CHECK(bench.gaps.empty());
}

TEST_CASE("counter: a failed attach forgets nothing of how long the tool was not listened to") {
  Bench bench("doga-bm");
  bench.happen();
  const ToolEvent last = standing(bench);
  bench.happen();
  bench.events.clear();
  bench.source = EventSource::make(bench.profile, EventMode::declared, bench.clock,
                                   [&bench](const auto& news) {
                                     if (const auto* gap = std::get_if<EventGap>(&news))
                                       bench.gaps.push_back(*gap);
                                   });
  bench.source->recall(device::LastEvent{*last.number, last.block, 24h});
  bench.wire.fate = test::next_meet(test::Fate::has_no_answer, 8);
  CHECK(!bench.attach());
  bench.wire.fate = {};
  REQUIRE(bench.attach());
  REQUIRE(bench.gaps.size() == 1);
  CHECK(bench.gaps.front().sequence == device::Sequence::doubtful);
}
