#include "spindle/device/command_register.hpp"

#include <doctest/doctest.h>

#include <memory>

#include "spindle/files/profile_store.hpp"
#include "spindle/modbus/pdu.hpp"
#include "spindle/sim/blv_driver.hpp"
#include "spindle/sim/sim_transport.hpp"
#include "support/fake_clock.hpp"

using namespace spindle;
using namespace std::chrono_literals;
using catalogue::StopMode;
using device::CommandRegister;
using device::CommandRegisterStopper;
using device::Shown;
using device::StopResult;

namespace {

constexpr std::uint32_t held = 1;
constexpr std::uint32_t forward = 0x00040000;
constexpr std::uint16_t command_at = 0x007C;
constexpr std::uint16_t stop_at = 0x01BE;

/// A simulated drive of a test profile, and a connection to it.
struct Bench {
  explicit Bench(const std::string& name) {
    const files::ProfileStore store({SPINDLE_SOURCE_DIR "/tests/profiles/good"});
    profile = store.load(name).value();
    bus = sim::make_profile_bus(profile, store.load_simulation(name).value(), {}, {});
  }

  device::Device open() {
    const device::OpenTransport line = [&](const link::Endpoint&, const catalogue::LinkFacts&,
                                           Duration) -> Result<std::unique_ptr<link::Transport>> {
      return sim::make_sim_transport(*bus, {++connections}, modbus::Framing::rtu, faults, answers,
                                     clock, never);
    };
    return device::Device::open({.text = "rtu:///dev/line",
                                 .medium = link::Medium::serial,
                                 .unit = modbus::UnitId{1}},
                                profile, {}, line, clock)
        .value();
  }

  void write(std::uint16_t address, std::uint32_t number) {
    const Registers words = {static_cast<std::uint16_t>(number >> 16U),
                             static_cast<std::uint16_t>(number & 0xFFFFU)};
    bus->answer({99}, {1}, modbus::write_request({address}, RegisterView(words)), clock.now());
  }
  std::uint32_t read(std::uint16_t address) {
    const auto answer = bus->answer(
        {99}, {1}, modbus::read_request(modbus::RegisterTable::holding, {address}, 2), clock.now());
    const Registers words = modbus::registers_of(answer.value());
    return std::uint32_t{words.at(0)} << 16U | words.at(1);
  }

  Interrupt never = Interrupt();
  test::FakeClock clock = {};
  catalogue::Profile profile;
  std::unique_ptr<sim::BlvBus> bus;
  sim::FaultPlan faults = {};
  sim::AnswerCounter answers = {};
  std::uint32_t connections = 0;
};

}  // namespace

TEST_CASE("a motor that is not held acknowledges its command and does not turn") {
  Bench bench("held-drive");
  auto device = bench.open();
  const auto model = CommandRegister::of(bench.profile).value();
  REQUIRE(model.command(device, forward));
  bench.clock.advance(2s);
  CHECK(model.monitor()->stands_still(device) == Shown::yes);
  REQUIRE(model.command(device, forward | held));
  bench.clock.advance(2s);
  const auto state = model.monitor()->look(device).value();
  CHECK(state.running);
  CHECK(state.at_speed);
  CHECK(state.command_speed == Decimal(1000));
  CHECK(state.feedback_speed == Decimal(10000, -1));
}

TEST_CASE("a stop keeps what enables a motor that another program started, by every register") {
  for (const StopMode mode : {StopMode::decelerate, StopMode::instant}) {
    CAPTURE(static_cast<int>(mode));
    Bench bench("held-drive");
    bench.write(command_at, forward | held);
    bench.clock.advance(2s);
    auto device = bench.open();
    const auto model = CommandRegister::of(bench.profile).value();
    CommandRegisterStopper stopper(model, mode);
    stopper.observe(device);
    CHECK(stopper.stop(device, bench.clock) == StopResult::confirmed);
    CHECK(bench.read(command_at) == (mode == StopMode::instant ? 0x21 : held));
    CHECK(bench.read(stop_at) == 1);
  }
}

TEST_CASE("a stop of which nothing is known never enables a motor") {
  Bench bench("held-drive");
  bench.write(command_at, forward);
  auto device = bench.open();
  const auto model = CommandRegister::of(bench.profile).value();
  CommandRegisterStopper stopper(model, StopMode::decelerate);
  CHECK(stopper.stop(device, bench.clock) == StopResult::confirmed);
  CHECK(bench.read(command_at) == 0);
}

TEST_CASE("a stop by who enabled a motor keeps it enabled, also where that can not be read") {
  Bench bench("held-drive");
  bench.write(command_at, forward | held);
  bench.clock.advance(2s);
  bench.faults = {{.kind = sim::FaultKind::lost, .at = 1}};
  auto device = bench.open();
  device.set_retries(0);
  const auto model = CommandRegister::of(bench.profile).value();
  const auto stopper = model.stopper(StopMode::decelerate);
  stopper->assume_enabled();
  stopper->observe(device);
  CHECK(stopper->stop(device, bench.clock) == StopResult::confirmed);
  CHECK(bench.read(command_at) == held);
}

TEST_CASE("what is read of a motor counts more than what its program was about to do") {
  Bench bench("held-drive");
  bench.write(command_at, forward);
  auto device = bench.open();
  const auto model = CommandRegister::of(bench.profile).value();
  const auto stopper = model.stopper(StopMode::decelerate);
  stopper->assume_enabled();
  stopper->observe(device);
  CHECK(stopper->stop(device, bench.clock) == StopResult::confirmed);
  CHECK(bench.read(command_at) == 0);
}

TEST_CASE("a motor that goes on turning is not called stopped, and is stopped harder") {
  Bench bench("held-drive");
  bench.write(command_at, forward | held);
  bench.clock.advance(2s);
  auto device = bench.open();
  // A profile that says 1 ms, and a drive that takes a second.
  const files::ProfileStore store({SPINDLE_SOURCE_DIR "/tests/profiles/good"});
  auto hasty = store.load("held-drive").value();
  auto facts = *hasty.run->command_register();
  facts.stopping = 1ms;
  hasty.run->model = facts;
  device.session().set_answer_timeout(100ms);
  const auto model = CommandRegister::of(hasty).value();
  CommandRegisterStopper stopper(model, StopMode::decelerate);
  stopper.observe(device);
  CHECK(stopper.stop(device, bench.clock) == StopResult::unconfirmed);
  CHECK(stopper.stop(device, bench.clock) == StopResult::confirmed);
  CHECK(bench.read(command_at) == 0x21);
}

TEST_CASE("a status that says neither runs nor stands still proves no standstill") {
  Bench bench("fc01-vfd");
  auto device = bench.open();
  auto model = CommandRegister::of(bench.profile).value();
  CHECK(model.monitor()->stands_still(device) == Shown::yes);
  auto facts = *bench.profile.run->command_register();
  facts.monitor.stopped_values = {4};
  auto other = bench.profile;
  other.run->model = facts;
  const auto doubtful = CommandRegister::of(other).value();
  CHECK(doubtful.monitor()->stands_still(device) == Shown::no);
}

TEST_CASE("without a status and a speed a stop is sent, and not confirmed") {
  Bench bench("fc01-vfd");
  auto blind = bench.profile;
  auto facts = *blind.run->command_register();
  facts.monitor = {};
  blind.run->model = facts;
  auto device = bench.open();
  const auto model = CommandRegister::of(blind).value();
  CHECK(model.monitor() == nullptr);
  const auto stopper = model.stopper(StopMode::decelerate);
  CHECK(stopper->stop(device, bench.clock) == StopResult::sent);
}
