#include <doctest/doctest.h>

#include <optional>
#include <string>
#include <vector>

#include "spindle/sim/simulated_tool.hpp"
#include "support/rig.hpp"

using namespace spindle;
using namespace std::chrono_literals;
using catalogue::EventKind;
using modbus::RegisterTable;

namespace {

/// A simulated tool of a profile that the program does not ship.
struct Simulated : test::DeviceRig {
  explicit Simulated(const std::string& name, const sim::DeviceOptions& how = {})
      : Rig(test::product(name), how) {}

  /// Empty: refused.
  std::optional<Registers> read(RegisterTable table, std::uint16_t first, std::uint16_t count = 1) {
    const modbus::Pdu response = ask(modbus::read_request(table, {first}, count)).value();
    if (modbus::exception_of(response)) return std::nullopt;
    return modbus::registers_of(response);
  }
  std::optional<std::uint8_t> write(std::uint16_t address, std::uint16_t value) {
    return modbus::exception_of(ask(modbus::write_request({address}, value)).value());
  }
};

}  // namespace

TEST_CASE("a flag is cleared by whatever reads it, and set by the next result") {
  Simulated device("kducer");
  CHECK(device.read(RegisterTable::input, 294) == Registers{0});
  device.tool->happen(EventKind::fastening_ok, device.clock.now());
  CHECK(device.read(RegisterTable::input, 295, 67).has_value());
  CHECK(device.read(RegisterTable::input, 294) == Registers{1});
  CHECK(device.read(RegisterTable::input, 294) == Registers{0});
  device.tool->happen(EventKind::fastening_ok, device.clock.now());
  CHECK(device.read(RegisterTable::input, 290, 10) == std::nullopt);
  CHECK(device.read(RegisterTable::input, 294, 4)->front() == 1);
  CHECK(device.read(RegisterTable::input, 294) == Registers{0});
}

TEST_CASE("what events say is given in turn, by kind") {
  Simulated device("kducer");
  std::vector<std::uint16_t> torques;
  for (const EventKind kind : {EventKind::fastening_ok, EventKind::fastening_ok,
                               EventKind::fastening_ng, EventKind::fastening_ok}) {
    device.tool->happen(kind, device.clock.now());
    torques.push_back(device.read(RegisterTable::input, 318)->front());
  }
  CHECK(torques == std::vector<std::uint16_t>{152, 149, 88, 152});
  CHECK(device.read(RegisterTable::input, 303) == Registers{1});
}

TEST_CASE("results come by themselves, and every so many are NG") {
  Simulated device("countermatic", {.rundown_every = 2s, .ng_every = 2});
  device.tool->advance(device.clock.now());
  device.clock.advance(6s);
  CHECK(device.read(RegisterTable::holding, 1000, 2) == Registers{3, 1});
  CHECK(device.tool->take_pushes().empty());
  device.clock.advance(2s);
  CHECK(device.read(RegisterTable::holding, 1000, 5) == Registers{4, 2, 0xFFFE, 0xEE8F, 7});
}

TEST_CASE("parameters are stored, and what does not exist or is too long is refused") {
  Simulated device("countermatic");
  CHECK(device.read(RegisterTable::holding, 10) == Registers{500});
  CHECK(device.write(10, 450) == std::nullopt);
  CHECK(device.read(RegisterTable::holding, 10) == Registers{450});
  CHECK(device.write(11, 1) == 2);
  CHECK(device.write(1000, 1) == 2);
  CHECK(device.read(RegisterTable::holding, 1000, 21) == std::nullopt);
  CHECK(device.read(RegisterTable::input, 1000) == std::nullopt);
  CHECK(modbus::exception_of(device.ask(modbus::report_server_id_request()).value()) == 1);
}

TEST_CASE("an alarm shows, and the action that resets it shows, too") {
  Simulated device("countermatic", {.alarms = {{.code = 7, .after = 1s}}});
  device.tool->advance(device.clock.now());
  device.clock.advance(1s);
  CHECK(device.read(RegisterTable::holding, 20) == Registers{7});
  CHECK(device.read(RegisterTable::holding, 1001) == Registers{3});
  CHECK(device.write(30, 1) == std::nullopt);
  CHECK(device.read(RegisterTable::holding, 20) == Registers{0});
}

TEST_CASE("faults of a tool are felt") {
  Simulated device("countermatic", {.faults = {sim::parse_fault("ignore-write@1").value()}});
  CHECK(device.write(10, 450) == std::nullopt);
  CHECK(device.read(RegisterTable::holding, 10) == Registers{500});
  CHECK(device.write(10, 450) == std::nullopt);
  CHECK(device.read(RegisterTable::holding, 10) == Registers{450});
}

TEST_CASE("a reboot counts from 0, and keeps what is stored") {
  Simulated device("countermatic");
  device.tool->happen(EventKind::fastening_ok, device.clock.now());
  device.write(10, 450);
  device.tool->reboot(device.clock.now());
  CHECK(device.read(RegisterTable::holding, 1000) == Registers{0});
  CHECK(device.read(RegisterTable::holding, 10) == Registers{450});
}

TEST_CASE("registers, events and a motor on a serial line need a profile only") {
  Simulated press("servo-press",
                  {.units = {3}, .rundown_every = 2s, .alarms = {{.code = 7, .after = 5s}}});
  press.tool->advance(press.clock.now());
  const auto ask = [&](const modbus::Pdu& request) { return press.ask(request, 3).value(); };
  const auto read = [&](std::uint16_t first) {
    return modbus::registers_of(ask(modbus::read_request(RegisterTable::holding, {first}, 1)))[0];
  };
  const auto write = [&](std::uint16_t first, const Registers& words) {
    return modbus::exception_of(ask(modbus::write_request({first}, RegisterView(words))));
  };
  CHECK_FALSE(press.ask(modbus::report_server_id_request(), 4).has_value());
  CHECK(modbus::server_id_of(ask(modbus::report_server_id_request())).size() == 3);
  CHECK(ask(modbus::loopback_request(7)) == modbus::loopback_request(7));
  CHECK(press.tool->required_gap() == 4ms);

  CHECK(write(0, {1, 900}) == std::nullopt);
  press.clock.advance(4s);
  CHECK(read(10) == 1);
  CHECK(read(11) == 900);
  CHECK(read(100) == 2);
  CHECK(read(102) == 42);

  press.clock.advance(1s);
  CHECK(read(12) == 7);
  CHECK(read(101) == 3);
  press.clock.advance(1s);
  CHECK(read(10) == 0);
  CHECK(write(0, {0}) == std::nullopt);
  CHECK(write(20, {1}) == std::nullopt);
  CHECK(read(12) == 0);
}

TEST_CASE("several registers are written all or none, and none behind the last address") {
  Simulated press("servo-press", {.units = {1}});
  CHECK(static_cast<test::DeviceRig&>(press).write(1, Registers{900, 0, 60'000}) == 3);
  CHECK(press.read(RegisterTable::holding, 1) == Registers{600});
  CHECK(static_cast<test::DeviceRig&>(press).write(1, Registers{900, 0, 50'000}) == 0);
  CHECK(press.read(RegisterTable::holding, 1, 3) == Registers{900, 0, 50'000});
  CHECK(static_cast<test::DeviceRig&>(press).write(65535, Registers{1, 1}) == 2);
}

TEST_CASE("an action shows until the value that ends it") {
  Simulated press("servo-press", {.units = {1}});
  CHECK(press.write(21, 1) == std::nullopt);
  CHECK(press.read(RegisterTable::holding, 13) == Registers{1});
  CHECK(press.write(21, 0) == std::nullopt);
  CHECK(press.read(RegisterTable::holding, 13) == Registers{0});
}

TEST_CASE("some alarms end only with the power, which keeps parameters and no command") {
  Simulated press("servo-press", {.units = {1}});
  press.write(0, 1);
  press.write(1, 900);
  press.tool->raise_alarm(1, 9, press.clock.now());
  press.write(20, 1);
  CHECK(press.read(RegisterTable::holding, 12) == Registers{9});
  press.tool->power_cycle(1, press.clock.now());
  CHECK(press.read(RegisterTable::holding, 12) == Registers{0});
  CHECK(press.read(RegisterTable::holding, 0, 2) == Registers{0, 900});
}
