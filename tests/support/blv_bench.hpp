#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "spindle/device/device.hpp"
#include "spindle/files/profile_store.hpp"
#include "spindle/modbus/pdu.hpp"
#include "spindle/sim/blv_driver.hpp"
#include "spindle/sim/sim_transport.hpp"
#include "support/fake_clock.hpp"

namespace spindle::test {

/// Simulated BLV drivers on one line, and a connection to one of them.
struct BlvBench {
  explicit BlvBench(const sim::BlvOptions& options = {}, sim::FaultPlan wire_faults = {})
      : faults(std::move(wire_faults)) {
    const files::ProfileStore store({SPINDLE_SOURCE_DIR "/profiles"});
    profile = store.load("orientalmotor-blv").value();
    bus = sim::make_blv_bus(profile, store.load_simulation("orientalmotor-blv").value(), options);
  }

  Result<device::Device> open(std::uint8_t unit = 1) {
    const device::OpenTransport line = [&](const link::Endpoint&, const catalogue::LinkFacts&,
                                           Duration) -> Result<std::unique_ptr<link::Transport>> {
      return sim::make_sim_transport(*bus, {++connections}, modbus::Framing::rtu, faults, answers,
                                     clock, never);
    };
    return device::Device::open(
        {.text = "rtu:///dev/line", .medium = link::Medium::serial, .unit = modbus::UnitId{unit}},
        profile, {}, line, clock);
  }

  /// Past the wire.
  void write(std::uint16_t address, std::uint16_t value, std::uint8_t unit = 1) {
    bus->answer({99}, {unit}, modbus::write_request({address}, value), clock.now());
  }
  std::uint16_t read(std::uint16_t address, std::uint8_t unit = 1) {
    const auto answer = bus->answer(
        {99}, {unit}, modbus::read_request(modbus::RegisterTable::holding, {address}, 1),
        clock.now());
    return modbus::registers_of(answer.value()).front();
  }
  [[nodiscard]] bool moves(std::uint8_t unit = 1) { return (read(0x007F, unit) & 0x2000U) != 0; }
  void configure(std::uint16_t even, std::uint16_t value) {
    write(static_cast<std::uint16_t>(even + 1), value);
    write(0x018D, 1);
    clock.advance(std::chrono::milliseconds(1100));
    write(0x018D, 0);
  }

  Interrupt never = Interrupt();
  FakeClock clock = {};
  catalogue::Profile profile;
  std::unique_ptr<sim::BlvBus> bus;
  sim::FaultPlan faults;
  sim::AnswerCounter answers = {};
  std::uint32_t connections = 0;
};

}  // namespace spindle::test
