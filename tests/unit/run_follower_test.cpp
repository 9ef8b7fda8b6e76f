#include "spindle/device/run_follower.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <chrono>

#include "support/rig.hpp"

namespace {

using namespace spindle;
using namespace std::chrono_literals;
using device::Device;
using device::EventOrigin;
using device::FollowedRun;
using device::FollowOptions;
using device::RunEnding;
using device::RunFollower;
using test::BmRig;
using test::Fate;

constexpr std::size_t number_at = 0;
constexpr std::size_t error_at = 10;
constexpr std::size_t status_at = 12;
constexpr std::uint16_t first_number = 1961;

/// A tool that a follower has prepared for a start.
struct Bench {
  explicit Bench(BmRig& of) : rig(of), device(of.open()) { REQUIRE(follower.prepare()); }
  void start() { REQUIRE(device.send(action, 1)); }
  Result<FollowedRun> follow(std::optional<Duration> limit = std::nullopt) {
    FollowOptions options;
    if (limit) options.deadline = rig.clock.now() + *limit;
    began = rig.clock.now();
    return follower.follow(options);
  }
  [[nodiscard]] Duration took() const { return rig.clock.now() - began; }
  /// Something happens to the tool so long after now.
  void after(Duration duration, std::function<void()> what) {
    rig.clock.at(rig.clock.now() + duration, std::move(what));
  }

  BmRig& rig;
  Device device;
  catalogue::Action action = rig.start_action();
  std::vector<device::ToolEvent> heard = {};
  RunFollower follower =
      RunFollower(device, action, rig.clock, [this](const auto& event) { heard.push_back(event); });
  TimePoint began = {};
};

/// Events without end that are no results, as changes of direction, numbered by this step.
std::function<modbus::Pdu()> flood(std::uint16_t step) {
  return [number = first_number, step]() mutable {
    Registers block(14, 0);
    block[number_at] = number = static_cast<std::uint16_t>(number + step);
    block[status_at] = 3;
    return modbus::read_response(modbus::RegisterTable::input, block);
  };
}

/// A run with this preset takes 19 seconds.
void slow_down(BmRig& rig) {
  rig.write(11, 9000);
  rig.write(13, 9000);
}

TEST_CASE("the result of a run is its event") {
  BmRig rig;
  Bench bench(rig);
  bench.start();
  const auto run = bench.follow();
  REQUIRE(run);
  CHECK(run->ending == RunEnding::result);
  REQUIRE(run->event);
  CHECK(run->event->source == EventOrigin::push);
  CHECK(run->event->block[status_at] == 1);
  CHECK(run->event->block[number_at] == first_number + 1);
  CHECK(bench.took() < 1500ms);
  CHECK(rig.starts() == 1);
  CHECK(rig.stops() == 0);  // a follower starts and stops nothing
}

TEST_CASE("the result of a tool that sends nothing unasked is fetched when its run has ended") {
  BmRig rig;
  rig.profile.events->model = catalogue::EventModel::counter;
  rig.profile.events->arm.reset();
  Bench bench(rig);
  bench.start();
  const auto run = bench.follow();
  REQUIRE(run);
  CHECK(run->ending == RunEnding::result);
  REQUIRE(run->event);
  CHECK(run->event->source == EventOrigin::catch_up);
  CHECK(run->event->block[number_at] == first_number + 1);
}

TEST_CASE("a run whose result could not be told from others is not begun") {
  BmRig rig;
  rig.profile.events->model = catalogue::EventModel::flag;
  rig.profile.events->number = {};
  Device device = rig.open();
  const catalogue::Action start = rig.start_action();
  const auto prepared = RunFollower(device, start, rig.clock).prepare();
  REQUIRE(!prepared);
  CHECK(prepared.error().code == Errc::usage);
}

TEST_CASE("every event of a run is heard when it comes, and once") {
  BmRig rig;
  slow_down(rig);
  Bench bench(rig);
  bench.start();
  std::vector<Duration> times;
  FollowOptions options;
  const TimePoint began = rig.clock.now();
  options.progress = [&](Duration elapsed) -> Result<void> {
    if (bench.heard.size() > times.size()) times.push_back(elapsed);
    return {};
  };
  options.deadline = began + 2s;
  bench.after(500ms, [&] { rig.wire.flood = flood(1); });
  bench.after(505ms, [&] { rig.wire.flood = {}; });
  const auto run = bench.follower.follow(options);
  REQUIRE(run);
  CHECK(run->ending == RunEnding::elapsed);
  REQUIRE(bench.heard.size() >= 3);
  for (std::size_t index = 0; index < bench.heard.size(); ++index) {
    CHECK(bench.heard[index].block[number_at] == first_number + 1 + index);
    CHECK(bench.heard[index].block[status_at] == 3);
  }
  REQUIRE_FALSE(times.empty());
  CHECK(times.front() < 800ms);
}

TEST_CASE("a run that another program ends too early is NG") {
  BmRig rig;
  Bench bench(rig);
  bench.start();
  bench.after(600ms, [&] { rig.write(4003, 0); });
  const auto run = bench.follow();
  REQUIRE(run);
  REQUIRE(run->event);
  CHECK(run->ending == RunEnding::result);
  CHECK(run->event->block[status_at] == 2);
  CHECK(bench.took() < 800ms);
}

TEST_CASE("an alarm ends a run as its result") {
  BmRig rig;
  Bench bench(rig);
  bench.start();
  bench.after(600ms, [&] { rig.tool->raise_alarm(1, 118, rig.clock.now()); });
  const auto run = bench.follow();
  REQUIRE(run);
  REQUIRE(run->event);
  CHECK(run->ending == RunEnding::result);
  CHECK(bench.took() < 1200ms);
}

TEST_CASE("events of before are no results") {
  BmRig rig;
  rig.write(4003, 1);  // a run of another program, up to its end
  rig.clock.advance(3s);
  Bench bench(rig);
  bench.start();
  const auto run = bench.follow();
  REQUIRE(run);
  REQUIRE(run->event);
  CHECK(run->event->block[number_at] == first_number + 2);
  CHECK(bench.took() > 1s);
}

TEST_CASE("an event that is pushed again is no second result") {
  BmRig rig;
  rig.faults = {{.kind = sim::FaultKind::push_before}};
  Bench bench(rig);  // now every answer comes behind the old event
  bench.start();
  const auto run = bench.follow();
  REQUIRE(run);
  REQUIRE(run->event);
  CHECK(run->event->block[number_at] == first_number + 1);
}

TEST_CASE("a result whose push was lost is fetched") {
  BmRig rig;
  Bench bench(rig);
  rig.write(4002, 0);
  REQUIRE(bench.device.switch_events(device::EventOutput::off));
  bench.start();
  const auto run = bench.follow();
  REQUIRE(run);
  REQUIRE(run->event);
  CHECK(run->ending == RunEnding::result);
  CHECK(run->event->source == EventOrigin::catch_up);
  CHECK(run->event->block[status_at] == 1);
}

TEST_CASE("loosening ends neither well nor badly, and still has its event") {
  BmRig rig;
  rig.write(4005, 1);
  Bench bench(rig);
  bench.start();
  const auto run = bench.follow();
  REQUIRE(run);
  CHECK(run->ending == RunEnding::result);
  REQUIRE(run->event);
  CHECK(run->event->block[status_at] == 0);
  CHECK(run->event->block[number_at] == first_number + 2);
}

TEST_CASE("a tool that is switched off and on has ended without a result") {
  BmRig rig;
  Bench bench(rig);
  bench.start();
  bench.after(600ms, [&] { rig.tool->reboot(rig.clock.now()); });
  const auto run = bench.follow();
  REQUIRE(run);
  CHECK(run->ending == RunEnding::ended);
  CHECK_FALSE(run->event);
}

TEST_CASE("a start that is only echoed is known after the answer time") {
  BmRig rig;
  rig.write(4001, 1);  // locked
  Bench bench(rig);
  bench.start();
  const auto run = bench.follow();
  REQUIRE(run);
  CHECK(run->ending == RunEnding::ignored);
  CHECK(bench.took() >= 1s);
  CHECK(bench.took() < 1300ms);
}

TEST_CASE("the time allowed is kept") {
  BmRig rig;
  slow_down(rig);
  Bench bench(rig);
  bench.start();
  SUBCASE("while all is well") {}
  SUBCASE("when the tool falls silent, however patient the user is") {
    bench.after(500ms, [&] { rig.wire.fate = [](const auto&) { return Fate::is_lost; }; });
  }
  const auto run = bench.follow(700ms);
  REQUIRE(run);
  CHECK(run->ending == RunEnding::elapsed);
  CHECK(bench.took() >= 700ms);
  CHECK(bench.took() < 750ms);
  CHECK(rig.runs());
}

TEST_CASE("the time allowed is kept however much the tool sends") {
  BmRig rig;
  slow_down(rig);
  Bench bench(rig);
  bench.start();
  rig.wire.flood = flood(0);
  const auto run = bench.follow(400ms);
  REQUIRE(run);
  CHECK(run->ending == RunEnding::elapsed);
  CHECK(bench.took() >= 400ms);
  CHECK(bench.took() < 450ms);
  // So is that for the event of the stop, which is asked for in the end.
  REQUIRE(bench.device.send_stop(bench.action));
  const TimePoint asked = rig.clock.now();
  const auto late = bench.follower.late_event();
  CHECK(rig.clock.now() - asked < 600ms);
  REQUIRE(late);
  REQUIRE(*late);
}

TEST_CASE("what a tool remembers across its restart is no result of a run") {
  BmRig rig;
  Bench bench(rig);
  bench.start();
  // Its counter begins anew: the OK with a smaller number may be of any run.
  bench.after(600ms, [&] {
    rig.tool->reboot(rig.clock.now());
    rig.write(4003, 1);
  });
  const auto run = bench.follow(5s);
  REQUIRE(run);
  CHECK_FALSE(run->event);
}

TEST_CASE("a patient user's tool that falls silent does not run on for minutes") {
  BmRig rig;
  rig.options.answer_timeout = 60s;
  rig.options.retries = 100;
  slow_down(rig);
  Bench bench(rig);
  bench.start();
  bench.after(500ms, [&] { rig.wire.fate = [](const auto&) { return Fate::is_lost; }; });
  const auto run = bench.follow(2s);
  REQUIRE(run);
  CHECK(run->ending == RunEnding::elapsed);
  CHECK(bench.took() < 2100ms);
}

TEST_CASE("one lost answer does not end a run, and silence does") {
  BmRig rig;
  slow_down(rig);
  Bench bench(rig);
  bench.start();
  const auto lose = [&](unsigned times) {
    bench.after(500ms, [&rig, times] {
      rig.wire.fate = [left = times](const auto&) mutable {
        return left > 0 && left-- > 0 ? Fate::is_lost : Fate::passes;
      };
    });
  };
  SUBCASE("one") {
    lose(1);
    const auto run = bench.follow(5s);
    REQUIRE(run);
    CHECK(run->ending == RunEnding::elapsed);
  }
  SUBCASE("all") {
    lose(1000);
    const auto run = bench.follow();
    REQUIRE_FALSE(run);
    CHECK(run.error().code == Errc::no_answer);
    CHECK(bench.took() < 3s);
  }
}

TEST_CASE("what ends the following early") {
  BmRig rig;
  slow_down(rig);
  Bench bench(rig);
  bench.start();
  FollowOptions options;
  Errc expected = Errc::internal;
  SUBCASE("an interrupt") {
    bench.after(500ms, [&] { rig.interrupt.raise(2); });
    expected = Errc::interrupted;
  }
  SUBCASE("a lost link") {
    bench.after(500ms, [&] { rig.wire.fate = [](const auto&) { return Fate::closes_unheard; }; });
    expected = Errc::closed;
  }
  SUBCASE("a reader that is gone") {
    options.progress = [](Duration elapsed) -> Result<void> {
      if (elapsed < 500ms) return {};
      return tl::unexpected(Error{.code = Errc::closed_pipe});
    };
    expected = Errc::closed_pipe;
  }
  SUBCASE("a refused reading") {
    bench.after(500ms, [&] { rig.wire.fate = [](const auto&) { return Fate::is_refused; }; });
    expected = Errc::exception_response;
  }
  const TimePoint began = rig.clock.now();
  const auto run = bench.follower.follow(options);
  REQUIRE_FALSE(run);
  CHECK(run.error().code == expected);
  CHECK(rig.clock.now() - began < 750ms);
}

TEST_CASE("a long run: the output stays armed, progress is told, and no read looks like an event") {
  BmRig rig;
  slow_down(rig);
  Bench bench(rig);
  bench.start();
  unsigned told = 0;
  FollowOptions options;
  options.progress = [&told](Duration) -> Result<void> {
    ++told;
    return {};
  };
  const auto run = bench.follower.follow(options);
  REQUIRE(run);
  CHECK(run->ending == RunEnding::result);
  REQUIRE(run->event);
  CHECK(run->event->source == EventOrigin::push);
  CHECK(told > 100);
  CHECK(rig.writes_of(BmRig::arm_register, 1) >= 4);
  CHECK(rig.starts() == 1);
  for (const auto& [at, request] : rig.wire.requests) {
    CHECK_FALSE((request.function == 4 && request.data.back() == 14));
  }
  bench.follower.disarm();
  CHECK(rig.wire.writes().back() == test::Wire::Write(BmRig::arm_register, 0));
}

TEST_CASE("the event that a stop causes is found") {
  BmRig rig;
  slow_down(rig);
  Bench bench(rig);
  bench.start();
  REQUIRE(bench.follow(500ms)->ending == RunEnding::elapsed);
  SUBCASE("by listening") {}
  SUBCASE("by asking, when it was not pushed") {
    REQUIRE(bench.device.switch_events(device::EventOutput::off));
  }
  REQUIRE(bench.device.send_stop(bench.action));
  const auto late = bench.follower.late_event();
  REQUIRE(late);
  REQUIRE(*late);
  CHECK((*late)->block[status_at] == 2);
  CHECK((*late)->block[error_at] == 333);
}

}  // namespace
