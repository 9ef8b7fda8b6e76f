#include "spindle/device/command_register.hpp"

#include <doctest/doctest.h>

#include "support/rig.hpp"

using namespace spindle;
using namespace std::chrono_literals;
using catalogue::StopMode;
using device::CommandRegister;
using device::CommandRegisterStopper;
using device::Shown;
using device::StopResult;
using test::BlvRig;

namespace {

constexpr std::uint32_t held = 1;
constexpr std::uint32_t forward = 0x00040000;
constexpr std::uint16_t command_at = 0x007C;
constexpr std::uint16_t stop_at = 0x01BE;

/// A command in its two registers.
Registers words(std::uint32_t command) {
  return {static_cast<std::uint16_t>(command >> 16U),
          static_cast<std::uint16_t>(command & 0xFFFFU)};
}

}  // namespace

TEST_CASE("a motor that is not held acknowledges its command and does not turn") {
  BlvRig rig(test::product("held-drive"), sim::DeviceOptions{});
  auto device = rig.open();
  const auto model = CommandRegister::of(rig.profile).value();
  REQUIRE(model.command(device, forward));
  rig.clock.advance(2s);
  CHECK(model.monitor()->stands_still(device) == Shown::yes);
  REQUIRE(model.command(device, forward | held));
  rig.clock.advance(2s);
  const auto state = model.monitor()->look(device).value();
  CHECK(state.running);
  CHECK(state.at_speed);
  CHECK(state.command_speed == Decimal(1000));
  CHECK(state.feedback_speed == Decimal(10000, -1));
}

TEST_CASE("a stop keeps what enables a motor that another program started, by every register") {
  for (const StopMode mode : {StopMode::decelerate, StopMode::instant}) {
    CAPTURE(static_cast<int>(mode));
    BlvRig rig(test::product("held-drive"), sim::DeviceOptions{});
    rig.write(command_at, words(forward | held));
    rig.clock.advance(2s);
    auto device = rig.open();
    const auto model = CommandRegister::of(rig.profile).value();
    CommandRegisterStopper stopper(model, mode);
    stopper.observe(device);
    CHECK(stopper.stop(device, rig.clock) == StopResult::confirmed);
    CHECK(rig.read_pair(command_at) == (mode == StopMode::instant ? 0x21 : held));
    CHECK(rig.read_pair(stop_at) == 1);
  }
}

TEST_CASE("a stop of which nothing is known never enables a motor") {
  BlvRig rig(test::product("held-drive"), sim::DeviceOptions{});
  rig.write(command_at, words(forward));
  auto device = rig.open();
  const auto model = CommandRegister::of(rig.profile).value();
  CommandRegisterStopper stopper(model, StopMode::decelerate);
  CHECK(stopper.stop(device, rig.clock) == StopResult::confirmed);
  CHECK(rig.read_pair(command_at) == 0);
}

TEST_CASE("a stop by who enabled a motor keeps it enabled, also where that cannot be read") {
  BlvRig rig(test::product("held-drive"), sim::DeviceOptions{});
  rig.write(command_at, words(forward | held));
  rig.clock.advance(2s);
  rig.faults = {{.kind = sim::FaultKind::lost, .at = 1}};
  auto device = rig.open();
  device.set_retries(0);
  const auto model = CommandRegister::of(rig.profile).value();
  const auto stopper = model.stopper(StopMode::decelerate);
  stopper->assume_enabled();
  stopper->observe(device);
  CHECK(stopper->stop(device, rig.clock) == StopResult::confirmed);
  CHECK(rig.read_pair(command_at) == held);
}

TEST_CASE("what is read of a motor counts more than what its program was about to do") {
  BlvRig rig(test::product("held-drive"), sim::DeviceOptions{});
  rig.write(command_at, words(forward));
  auto device = rig.open();
  const auto model = CommandRegister::of(rig.profile).value();
  const auto stopper = model.stopper(StopMode::decelerate);
  stopper->assume_enabled();
  stopper->observe(device);
  CHECK(stopper->stop(device, rig.clock) == StopResult::confirmed);
  CHECK(rig.read_pair(command_at) == 0);
}

TEST_CASE("a motor that goes on turning is not called stopped, and is stopped harder") {
  BlvRig rig(test::product("held-drive"), sim::DeviceOptions{});
  rig.write(command_at, words(forward | held));
  rig.clock.advance(2s);
  auto device = rig.open();
  // A profile that says 1 ms, and a drive that takes a second.
  auto hasty = rig.profile;
  auto facts = *hasty.run->command_register();
  facts.stopping = 1ms;
  hasty.run->model = facts;
  device.session().set_answer_timeout(100ms);
  const auto model = CommandRegister::of(hasty).value();
  CommandRegisterStopper stopper(model, StopMode::decelerate);
  stopper.observe(device);
  CHECK(stopper.stop(device, rig.clock) == StopResult::unconfirmed);
  CHECK(stopper.stop(device, rig.clock) == StopResult::confirmed);
  CHECK(rig.read_pair(command_at) == 0x21);
}

TEST_CASE("a status that says neither runs nor stands still proves no standstill") {
  BlvRig rig(test::product("fc01-vfd"), sim::DeviceOptions{});
  auto device = rig.open();
  auto model = CommandRegister::of(rig.profile).value();
  CHECK(model.monitor()->stands_still(device) == Shown::yes);
  auto facts = *rig.profile.run->command_register();
  facts.monitor.stopped_values = {4};
  auto other = rig.profile;
  other.run->model = facts;
  const auto doubtful = CommandRegister::of(other).value();
  CHECK(doubtful.monitor()->stands_still(device) == Shown::no);
}

TEST_CASE("without a status and a speed a stop is sent, and not confirmed") {
  BlvRig rig(test::product("fc01-vfd"), sim::DeviceOptions{});
  auto blind = rig.profile;
  auto facts = *blind.run->command_register();
  facts.monitor = {};
  blind.run->model = facts;
  auto device = rig.open();
  const auto model = CommandRegister::of(blind).value();
  CHECK(model.monitor() == nullptr);
  const auto stopper = model.stopper(StopMode::decelerate);
  CHECK(stopper->stop(device, rig.clock) == StopResult::sent);
}
