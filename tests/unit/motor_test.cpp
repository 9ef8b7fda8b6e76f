#include <doctest/doctest.h>

#include <chrono>
#include <vector>

#include "spindle/device/command_word.hpp"
#include "spindle/device/motor_follower.hpp"
#include "support/rig.hpp"

namespace {

using namespace spindle;
using namespace std::chrono_literals;
using catalogue::StopMode;
using device::CommandWord;
using device::CommandWordStopper;
using device::MotorEvent;
using device::MotorState;
using device::StopResult;
using test::BlvRig;

constexpr std::uint16_t command = 0x007D;

std::vector<MotorEvent> between(const MotorState& before, const MotorState& now) {
  return device::events_between(before, now);
}

}  // namespace

TEST_CASE("events are what differs between two looks") {
  const MotorState still;
  MotorState starting{.running = true};
  MotorState running{.running = true, .at_speed = true};
  MotorState failed{.alarm = 0x30};
  CHECK(between(still, still).empty());
  CHECK(between(still, starting) == std::vector{MotorEvent::started});
  CHECK(between(starting, running) == std::vector{MotorEvent::at_speed});
  CHECK(between(still, running) == std::vector{MotorEvent::started, MotorEvent::at_speed});
  CHECK(between(running, running).empty());
  CHECK(between(running, still) == std::vector{MotorEvent::stopped});
  CHECK(between(running, failed) == std::vector{MotorEvent::alarm, MotorEvent::stopped});
  CHECK(between(failed, failed).empty());
  CHECK(between(failed, {.alarm = 0x85}) == std::vector{MotorEvent::alarm});
  CHECK(between(failed, still).empty());
  CHECK(between(still, {.warning = 0x21}) == std::vector{MotorEvent::warning});
  CHECK(between({.warning = 0x21}, still).empty());
}

TEST_CASE("only products that are run by a command word have a motor") {
  catalogue::Profile profile;
  profile.id = "none";
  CHECK(CommandWord::of(profile).error().code == Errc::usage);
}

TEST_CASE("a look shows the state, the speeds and the codes") {
  BlvRig rig;
  auto device = rig.open();
  const CommandWord motor = CommandWord::of(rig.profile).value();
  rig.write(command, 0x32);
  rig.clock.advance(1s);
  auto state = motor.monitor()->look(device).value();
  CHECK(state.running);
  CHECK(state.at_speed);
  CHECK(state.feedback_speed == Decimal(-1000));
  CHECK(state.load == Decimal(18));
  rig.tool->raise_warning(1, 0x21, rig.clock.now());
  rig.tool->raise_alarm(1, 0x30, rig.clock.now());
  rig.clock.advance(1s);
  state = motor.monitor()->look(device).value();
  CHECK_FALSE(state.running);
  CHECK(state.alarm == 0x30);
  CHECK(state.warning == 0x21);
  CHECK(state.command_speed == Decimal(0));
}

namespace {

struct Stop {
  std::uint16_t input_mode;
  std::uint16_t word;
  StopMode how;
  std::uint16_t expected;
};

}  // namespace

TEST_CASE("a motor is stopped by the word of its input mode") {
  const Stop stops[] = {
      {0, 0x2A, StopMode::decelerate, 0x22}, {0, 0x32, StopMode::decelerate, 0x22},
      {0, 0x2A, StopMode::instant, 0x02},    {0, 0x0A, StopMode::decelerate, 0x22},
      {1, 0x1A, StopMode::decelerate, 0x12}, {1, 0x3A, StopMode::decelerate, 0x12},
      {1, 0x1A, StopMode::instant, 0x0A},
  };
  for (const Stop& stop : stops) {
    CAPTURE(stop.word);
    BlvRig rig;
    if (stop.input_mode == 1) rig.configure(0x1040, 1);
    rig.write(command, stop.word);
    rig.clock.advance(1s);
    REQUIRE(rig.moves());
    auto device = rig.open();
    const CommandWord motor = CommandWord::of(rig.profile).value();
    CommandWordStopper stopper(motor, stop.how);
    stopper.observe(device);
    CHECK(stopper.stop(device, rig.clock) == StopResult::confirmed);
    if (stop.how == StopMode::decelerate) CHECK(stopper.stopping() == 500ms);
    CHECK(rig.read(command) == stop.expected);
    CHECK_FALSE(rig.moves());
  }
}

// 12h decelerates in 3-wire mode and runs in reverse in 2-wire mode; the register shows 3-wire from
// the moment it is written, the driver heeds it from Configuration on.
TEST_CASE("a mode that was written and not configured never turns a stop into a start") {
  for (const std::uint16_t word : {std::uint16_t{0x00}, std::uint16_t{0x2A}, std::uint16_t{0x32}}) {
    CAPTURE(word);
    BlvRig rig;
    rig.write(0x1041, 1);
    rig.write(command, word);
    rig.clock.advance(1s);
    auto device = rig.open();
    const CommandWord motor = CommandWord::of(rig.profile).value();
    CommandWordStopper stopper(motor, StopMode::decelerate);
    stopper.observe(device);
    auto stopped = stopper.stop(device, rig.clock);
    if (stopped == StopResult::unconfirmed) stopped = stopper.stop(device, rig.clock);
    CHECK(stopped == StopResult::confirmed);
    CHECK((rig.read(command) & 0x18U) == 0);
    CHECK_FALSE(rig.moves());
  }
}

TEST_CASE("a gentle stop that does not help becomes a hard one") {
  BlvRig rig;
  rig.write(0x0685, 150);  // fifteen seconds, which the stopper is told nothing of
  rig.write(command, 0x2A);
  rig.clock.advance(1s);
  auto device = rig.open();
  const CommandWord motor = CommandWord::of(rig.profile).value();
  CommandWordStopper stopper(motor, StopMode::decelerate);
  stopper.started(0x2A, 0, motor.read_bits(device, 0xFFFF).value(), 300ms);
  stopper.seen_running();
  CHECK(stopper.stop(device, rig.clock) == StopResult::unconfirmed);
  CHECK(rig.read(command) == 0x22);
  CHECK(rig.moves());
  CHECK(stopper.stop(device, rig.clock) == StopResult::confirmed);
  CHECK(rig.read(command) == 0x00);
}

TEST_CASE("without anything known a motor is stopped by the word that no assignment starts by") {
  for (const StopMode how : {StopMode::decelerate, StopMode::instant}) {
    BlvRig rig;
    rig.configure(0x1040, 1);
    rig.write(command, 0x1A);
    rig.clock.advance(1s);
    auto device = rig.open();
    const CommandWord motor = CommandWord::of(rig.profile).value();
    CommandWordStopper stopper(motor, how);
    CHECK(stopper.stop(device, rig.clock) == StopResult::confirmed);
    CHECK(rig.read(command) == 0x00);
  }
}

namespace {

/// Puts a function on an input of the simulated driver.
void assign(BlvRig& rig, unsigned input, std::uint16_t function) {
  rig.write(static_cast<std::uint16_t>(0x1161 + 2 * input), function);
}

struct Assignment {
  const char* what;
  std::vector<std::pair<unsigned, std::uint16_t>> inputs;
};

}  // namespace

TEST_CASE("no assignment of the inputs makes a stop start a motor") {
  const Assignment assignments[] = {
      {"FWD instead of STOP-MODE", {{5, 1}}},
      {"REV instead of STOP-MODE", {{5, 2}}},
      {"FWD and STOP-MODE changed", {{3, 19}, {5, 1}}},
      {"FWD to select operation data", {{0, 1}, {1, 2}, {3, 48}, {4, 49}}},
      {"a function that is not known", {{5, 77}}},
      {"nothing", {{0, 0}, {1, 0}, {2, 0}, {3, 0}, {4, 0}, {5, 0}}},
      {"FWD on the upper half", {{3, 0}, {8, 1}}},
  };
  const std::vector<std::uint16_t> words = {0x00, 0x02, 0x0A, 0x22, 0x2A, 0x12, 0x07};
  for (const Assignment& assignment : assignments) {
    CAPTURE(assignment.what);
    for (const StopMode how : {StopMode::decelerate, StopMode::instant}) {
      for (const std::uint16_t word : words) {
        CAPTURE(word);
        BlvRig rig;
        rig.write(0x0481, 1000);
        for (const auto& [input, function] : assignment.inputs) assign(rig, input, function);
        rig.write(command, word);
        rig.clock.advance(1s);
        const bool ran = rig.moves();
        auto device = rig.open();
        const CommandWord motor = CommandWord::of(rig.profile).value();
        CommandWordStopper stopper(motor, how);
        stopper.observe(device);
        REQUIRE(stopper.send(device));
        rig.clock.advance(1ms);
        if (!ran) CHECK_FALSE(rig.moves());
        rig.clock.advance(1s);
        CHECK_FALSE(rig.moves());
      }
    }
  }
}

TEST_CASE("a motor is stopped gently by the inputs that its driver has for it") {
  BlvRig rig;
  assign(rig, 3, 19);
  assign(rig, 5, 1);
  rig.write(command, 0x2A);
  rig.clock.advance(1s);
  REQUIRE(rig.moves());
  auto device = rig.open();
  const CommandWord motor = CommandWord::of(rig.profile).value();
  CommandWordStopper stopper(motor, StopMode::decelerate);
  stopper.observe(device);
  REQUIRE(stopper.send(device));
  CHECK(rig.read(command) == 0x0A);
  rig.clock.advance(100ms);
  CHECK(rig.moves());  // it decelerates
  CHECK(stopper.stop(device, rig.clock) == StopResult::confirmed);
  CHECK(stopper.stopping() == 500ms);
}

TEST_CASE("a stop does not wait for what cannot be read") {
  BlvRig rig;
  rig.write(command, 0x2A);
  rig.clock.advance(1s);
  rig.faults = {{.kind = sim::FaultKind::lost, .at = 1}};
  auto device = rig.open();
  device.set_retries(0);
  const CommandWord motor = CommandWord::of(rig.profile).value();
  CommandWordStopper stopper(motor, StopMode::decelerate);
  const TimePoint began = rig.clock.now();
  stopper.observe(device);
  CHECK(rig.clock.now() - began < 400ms);
  CHECK(device.session().options().answer_timeout == rig.profile.link.answer);
  static_cast<void>(stopper.send(device));
  CHECK(rig.read(command) == 0x00);
  CHECK_FALSE(rig.moves());
}

TEST_CASE("a guard stops a motor, also when it is not called") {
  BlvRig rig;
  auto device = rig.open();
  const CommandWord motor = CommandWord::of(rig.profile).value();
  CommandWordStopper stopper(motor, StopMode::decelerate);
  stopper.started(0x2A, 0, motor.read_bits(device, 0xFFFF).value(), 500ms);
  const device::GuardedMotion motion{
      .start = [&](device::Device& on) { return motor.command(on, 0x2A); },
      .stop = [&](device::Device& on, Clock& clock) { return stopper.stop(on, clock); },
      .stopping = 500ms};
  const auto reopen = [&](Duration) { return rig.open(); };
  SUBCASE("at the end of a scope") {
    device::RunGuard guard(device, motion, reopen, rig.clock);
    REQUIRE(guard.start());
    rig.clock.advance(1s);
    CHECK(rig.moves());
  }
  SUBCASE("on a line that loses answers") {
    rig.faults = {{.kind = sim::FaultKind::lost, .every = 4}};
    device = rig.open();
    device::RunGuard guard(device, motion, reopen, rig.clock);
    static_cast<void>(guard.start());
    rig.clock.advance(1s);
    CHECK(guard.stop().result == StopResult::confirmed);
  }
  SUBCASE("in an alarm") {
    device::RunGuard guard(device, motion, reopen, rig.clock);
    REQUIRE(guard.start());
    rig.clock.advance(1s);
    rig.tool->raise_alarm(1, 0x30, rig.clock.now());
    CHECK(guard.stop().result == StopResult::confirmed);
  }
  CHECK_FALSE(rig.moves());
  CHECK((rig.read(command) & 0x18U) == 0);
}

TEST_CASE("following tells what happens, and why it is over") {
  BlvRig rig;
  auto device = rig.open();
  const CommandWord motor = CommandWord::of(rig.profile).value();
  CommandWordStopper stopper(motor, StopMode::decelerate);
  std::vector<device::MotorTransition> news;
  device::MotorFollowOptions options{.deadline = rig.clock.now() + 3s, .fastest = Decimal(1000)};
  options.on_transition = [&](const device::MotorTransition& one) { news.push_back(one); };
  SUBCASE("elapsed") {
    rig.write(command, 0x2A);
    CHECK(follow_motor(device, *motor.monitor(), stopper, options) == device::MotorEnding::elapsed);
    REQUIRE(news.size() == 2);
    CHECK(news[0].event == MotorEvent::started);
    CHECK(news[1].event == MotorEvent::at_speed);
  }
  SUBCASE("alarm") {
    rig.write(command, 0x2A);
    rig.clock.at(rig.clock.now() + 1s, [&] { rig.tool->raise_alarm(1, 0x30, rig.clock.now()); });
    CHECK(follow_motor(device, *motor.monitor(), stopper, options) == device::MotorEnding::alarm);
    CHECK(news.back().event == MotorEvent::alarm);
  }
  SUBCASE("stopped by another master") {
    rig.write(command, 0x2A);
    rig.clock.at(rig.clock.now() + 1s, [&] { rig.write(command, 0); });
    CHECK(follow_motor(device, *motor.monitor(), stopper, options) == device::MotorEnding::stopped);
  }
  SUBCASE("ignored") {
    CHECK(follow_motor(device, *motor.monitor(), stopper, options) == device::MotorEnding::ignored);
    options.deadline = rig.clock.now() + 200ms;
    CHECK(follow_motor(device, *motor.monitor(), stopper, options) == device::MotorEnding::ignored);
  }
  SUBCASE("over before it could be looked at") {
    rig.write(command, 0x2A);
    options.deadline = rig.clock.now();
    const auto followed = follow_motor(device, *motor.monitor(), stopper, options);
    REQUIRE_FALSE(followed);
    CHECK(followed.error().code == Errc::negative);
    CHECK(news.empty());
  }
  SUBCASE("too fast") {
    options.fastest = Decimal(900);
    rig.write(command, 0x32);
    CHECK(follow_motor(device, *motor.monitor(), stopper, options) ==
          device::MotorEnding::too_fast);
  }
}

TEST_CASE("a driver that falls silent is hardly waited for beyond the time allowed") {
  BlvRig rig;
  for (std::uint32_t at = 20; at < 200; ++at) {
    rig.faults.push_back({.kind = sim::FaultKind::lost, .at = at});
  }
  auto device = rig.open();
  const CommandWord motor = CommandWord::of(rig.profile).value();
  CommandWordStopper stopper(motor, StopMode::decelerate);
  device.session().set_answer_timeout(60s);  // a patient user
  device.set_retries(9);
  rig.write(command, 0x2A);
  const TimePoint began = rig.clock.now();
  device::MotorFollowOptions options{.deadline = began + 3s, .fastest = Decimal(1000)};
  const auto followed = follow_motor(device, *motor.monitor(), stopper, options);
  CHECK(rig.clock.now() - began < 4s);
  CHECK(rig.moves());
}
