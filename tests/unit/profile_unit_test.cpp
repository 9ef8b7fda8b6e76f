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
struct Plain : test::DeviceRig {
  explicit Plain(const std::string& name, const sim::DeviceOptions& how = {})
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
  Plain plain("kducer");
  CHECK(plain.read(RegisterTable::input, 294) == Registers{0});
  plain.tool->happen(EventKind::fastening_ok, plain.clock.now());
  CHECK(plain.read(RegisterTable::input, 295, 67).has_value());
  CHECK(plain.read(RegisterTable::input, 294) == Registers{1});
  CHECK(plain.read(RegisterTable::input, 294) == Registers{0});
  plain.tool->happen(EventKind::fastening_ok, plain.clock.now());
  CHECK(plain.read(RegisterTable::input, 290, 10) == std::nullopt);
  CHECK(plain.read(RegisterTable::input, 294, 4)->front() == 1);
  CHECK(plain.read(RegisterTable::input, 294) == Registers{0});
}

TEST_CASE("what events say is given in turn, by kind") {
  Plain plain("kducer");
  std::vector<std::uint16_t> torques;
  for (const EventKind kind : {EventKind::fastening_ok, EventKind::fastening_ok,
                               EventKind::fastening_ng, EventKind::fastening_ok}) {
    plain.tool->happen(kind, plain.clock.now());
    torques.push_back(plain.read(RegisterTable::input, 318)->front());
  }
  CHECK(torques == std::vector<std::uint16_t>{152, 149, 88, 152});
  CHECK(plain.read(RegisterTable::input, 303) == Registers{1});
}

TEST_CASE("results come by themselves, and every so many are NG") {
  Plain plain("countermatic", {.rundown_every = 2s, .ng_every = 2});
  plain.tool->advance(plain.clock.now());
  plain.clock.advance(6s);
  CHECK(plain.read(RegisterTable::holding, 1000, 2) == Registers{3, 1});
  CHECK(plain.tool->take_pushes().empty());
  plain.clock.advance(2s);
  CHECK(plain.read(RegisterTable::holding, 1000, 5) == Registers{4, 2, 0xFFFE, 0xEE8F, 7});
}

TEST_CASE("parameters are stored, and what does not exist or is too long is refused") {
  Plain plain("countermatic");
  CHECK(plain.read(RegisterTable::holding, 10) == Registers{500});
  CHECK(plain.write(10, 450) == std::nullopt);
  CHECK(plain.read(RegisterTable::holding, 10) == Registers{450});
  CHECK(plain.write(11, 1) == 2);
  CHECK(plain.write(1000, 1) == 2);
  CHECK(plain.read(RegisterTable::holding, 1000, 21) == std::nullopt);
  CHECK(plain.read(RegisterTable::input, 1000) == std::nullopt);
  CHECK(modbus::exception_of(plain.ask(modbus::report_server_id_request()).value()) == 1);
}

TEST_CASE("an alarm shows, and the action that resets it shows, too") {
  Plain plain("countermatic", {.alarms = {{.code = 7, .after = 1s}}});
  plain.tool->advance(plain.clock.now());
  plain.clock.advance(1s);
  CHECK(plain.read(RegisterTable::holding, 20) == Registers{7});
  CHECK(plain.read(RegisterTable::holding, 1001) == Registers{3});
  CHECK(plain.write(30, 1) == std::nullopt);
  CHECK(plain.read(RegisterTable::holding, 20) == Registers{0});
}

TEST_CASE("faults of a tool are felt") {
  Plain plain("countermatic", {.faults = {sim::parse_fault("ignore-write@1").value()}});
  CHECK(plain.write(10, 450) == std::nullopt);
  CHECK(plain.read(RegisterTable::holding, 10) == Registers{500});
  CHECK(plain.write(10, 450) == std::nullopt);
  CHECK(plain.read(RegisterTable::holding, 10) == Registers{450});
}

TEST_CASE("a reboot counts from 0, and keeps what is stored") {
  Plain plain("countermatic");
  plain.tool->happen(EventKind::fastening_ok, plain.clock.now());
  plain.write(10, 450);
  plain.tool->reboot(plain.clock.now());
  CHECK(plain.read(RegisterTable::holding, 1000) == Registers{0});
  CHECK(plain.read(RegisterTable::holding, 10) == Registers{450});
}
