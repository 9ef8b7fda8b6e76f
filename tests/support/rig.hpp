#pragma once

#include <algorithm>
#include <memory>
#include <string>
#include <utility>

#include "spindle/device/device.hpp"
#include "spindle/files/profile_store.hpp"
#include "spindle/modbus/pdu.hpp"
#include "spindle/posix/disk.hpp"
#include "spindle/sim/sim_transport.hpp"
#include "spindle/sim/simulated_tool.hpp"
#include "support/bm_profile.hpp"
#include "support/fake_clock.hpp"
#include "support/fault_plan.hpp"
#include "support/wire.hpp"

namespace spindle::test {

/// A profile, and the state in which its simulated device begins.
struct Product {
  catalogue::Profile profile;
  catalogue::SimulationSpec start = {};
};

/// The screwdriver that is built in code: three presets.
inline Product small_bm() { return {bm_profile(), bm_start()}; }

/// A product that is shipped, or one of tests/profiles/good.
inline Product product(const std::string& name) {
  static const files::ProfileStore store(
      {SPINDLE_SOURCE_DIR "/profiles", SPINDLE_SOURCE_DIR "/tests/profiles/good"},
      posix::source_disk());
  return {store.load(name).value(), store.load_simulation(name).value()};
}

inline std::unique_ptr<sim::SimulatedBus> simulated(const Product& of,
                                                    const sim::DeviceOptions& options) {
  return sim::make_simulated_bus(of.profile, of.start, options);
}

/// One simulated device on a clock that is moved by hand, the wire to it, and connections. What a
/// test is about it sets before it connects: `profile`, `faults`, `options`, the fates on `wire`.
template <typename Server>
class Rig {
 public:
  Rig(Product product, std::unique_ptr<Server> server)
      : profile(std::move(product.profile)),
        wire(clock, profile.link.framing),
        tool(std::move(server)) {
    const bool serial = profile.link.framing == modbus::Framing::rtu;
    endpoint = link::parse_endpoint(serial ? "rtu:///dev/line?unit=1" : "tcp://tool:5000").value();
  }
  Rig(Product product, const sim::DeviceOptions& how) : Rig(product, simulated(product, how)) {}

  /// A connection past Device. It outlives neither the rig nor the clock and interrupt.
  std::unique_ptr<link::Transport> transport(Clock& on, const Interrupt& heeding) {
    return wire.tap(sim::make_sim_transport(*tool, {wire.connections + 1}, profile.link.framing,
                                            faults, answers, on, heeding, line));
  }
  Result<device::Device> connect(Clock& on, const Interrupt& heeding) {
    const auto open = [&](const auto&, const auto&,
                          Duration) -> Result<std::unique_ptr<link::Transport>> {
      if (auto reached = wire.attempt(); !reached) return tl::unexpected(reached.error());
      return transport(on, heeding);
    };
    return device::Device::open(endpoint, profile, options, open, on);
  }
  Result<device::Device> connect() { return connect(clock, interrupt); }
  /// Behind an interrupt, as the last words that leave a tool safe are said.
  Result<device::Device> connect_uninterruptibly() { return connect(uninterruptible, never); }
  device::Device open() { return std::move(connect().value()); }

  // Past the wire, as another program does it.
  std::optional<modbus::Pdu> ask(const modbus::Pdu& request, std::uint8_t unit = 1) {
    return tool->answer(sim::ConnectionId{99}, {unit}, request, clock.now());
  }
  /// The exception; 0: none.
  int write(std::uint16_t address, std::uint16_t word, std::uint8_t unit = 1) {
    return modbus::exception_of(ask(modbus::write_request({address}, word), unit).value())
        .value_or(0);
  }
  int write(std::uint16_t first, const Registers& words, std::uint8_t unit = 1) {
    const auto request = modbus::write_request({first}, RegisterView(words));
    return modbus::exception_of(ask(request, unit).value()).value_or(0);
  }
  Registers registers(modbus::RegisterTable table, std::uint16_t first, std::uint16_t count,
                      std::uint8_t unit = 1) {
    return modbus::registers_of(ask(modbus::read_request(table, {first}, count), unit).value());
  }
  std::uint16_t read(std::uint16_t address, std::uint8_t unit = 1) {
    return registers(modbus::RegisterTable::holding, address, 1, unit).front();
  }
  std::uint16_t read_input(std::uint16_t address) {
    return registers(modbus::RegisterTable::input, address, 1).front();
  }
  /// Two registers, the higher word first.
  std::uint32_t read_pair(std::uint16_t first, std::uint8_t unit = 1) {
    const Registers words = registers(modbus::RegisterTable::holding, first, 2, unit);
    return std::uint32_t{words.at(0)} << 16U | words.at(1);
  }
  void wait(Duration time) {
    clock.advance(time);
    tool->advance(clock.now());
  }

  Interrupt interrupt = Interrupt();
  const Interrupt never = Interrupt();
  FakeClock clock = FakeClock(interrupt);
  UninterruptibleClock uninterruptible = UninterruptibleClock(clock);
  catalogue::Profile profile;
  sim::FaultPlan faults = {};
  sim::AnswerCounter answers = {};
  sim::LineModel line = {};
  Wire wire;
  std::unique_ptr<Server> tool;
  link::Endpoint endpoint;
  device::LinkOptions options = {};
};

using DeviceRig = Rig<sim::SimulatedBus>;

/// A screwdriver whose runs are begun and ended by one register.
struct BmRig : DeviceRig {
  static constexpr std::uint16_t arm_register = 4002;
  static constexpr std::uint16_t start_register = 4003;

  using Rig::Rig;
  explicit BmRig(const sim::DeviceOptions& how = {}) : Rig(small_bm(), how) {}

  [[nodiscard]] bool runs() { return read_input(3307) != 0; }
  [[nodiscard]] std::size_t writes_of(std::uint16_t address, std::uint16_t word) const {
    const auto writes = wire.writes();
    return static_cast<std::size_t>(
        std::count(writes.begin(), writes.end(), Wire::Write(address, word)));
  }
  [[nodiscard]] std::size_t starts() const { return writes_of(start_register, 1); }
  [[nodiscard]] std::size_t stops() const { return writes_of(start_register, 0); }
  [[nodiscard]] catalogue::Action start_action() const {
    return profile.find_action("start").value();
  }
};

/// Motor drivers on one line that follow a command word, or those of another profile.
struct BlvRig : DeviceRig {
  using Rig::Rig;
  explicit BlvRig(const sim::DeviceOptions& how = {})
      : Rig(test::product("orientalmotor-blv"), how) {}

  [[nodiscard]] bool moves(std::uint8_t unit = 1) { return (read(0x007F, unit) & 0x2000U) != 0; }
  /// Sets a parameter that acts behind Configuration only.
  void configure(std::uint16_t even, std::uint16_t word) {
    write(static_cast<std::uint16_t>(even + 1), word);
    write(0x018D, 1);
    clock.advance(std::chrono::milliseconds(1100));
    write(0x018D, 0);
  }
};

}  // namespace spindle::test
