#include <doctest/doctest.h>

#include <chrono>
#include <string>

#include "spindle/catalogue/value.hpp"
#include "spindle/modbus/adu.hpp"
#include "spindle/sim/simulated_tool.hpp"
#include "support/rig.hpp"
#include "unit/hex.hpp"

namespace {

using namespace spindle;
using namespace std::chrono_literals;
using modbus::Pdu;
using modbus::RegisterTable;

/// Drivers on a bus, and a master that talks to them in PDUs. The addresses are those of the notes.
struct Bus : test::BlvRig {
  static constexpr std::uint16_t command = 0x007D;
  static constexpr std::uint16_t status = 0x007F;
  static constexpr std::uint16_t alarm = 0x0081;
  static constexpr std::uint16_t last_error = 0x00AD;
  static constexpr std::uint16_t speed_now = 0x00CE;
  static constexpr unsigned move = 1U << 13;
  static constexpr unsigned at_speed = 1U << 14;
  static constexpr unsigned busy = 1U << 8;

  using BlvRig::BlvRig;

  std::int32_t pair(std::uint16_t even, std::uint8_t unit = 1) {
    return static_cast<std::int32_t>(read_pair(even, unit));
  }
  void pulse(std::uint16_t address) {
    CHECK(write(address, 1) == 0);
    wait(1100ms);
    CHECK(write(address, 0) == 0);
  }
  bool shows(unsigned bit, std::uint8_t unit = 1) { return (read(status, unit) & bit) != 0; }
};

}  // namespace

TEST_CASE("blv driver: what lies outside its map or its limits is refused, and it says why") {
  Bus bus;
  const auto refused = [&](const Pdu& request) {
    return modbus::exception_of(bus.ask(request).value()).value_or(0);
  };
  const auto read = [](std::uint16_t first, std::uint16_t count) {
    return modbus::read_request(RegisterTable::holding, {first}, count);
  };
  CHECK(refused(read(0x0480, 16)) == 0);
  CHECK(refused(read(0x1FFE, 1)) == 0);
  CHECK(refused(read(0x1FFF, 1)) == 2);  // address and count reach 2000h together
  CHECK(refused(read(0x2000, 1)) == 2);
  CHECK(bus.read(Bus::last_error) == 0x88);
  CHECK(refused(read(0x1FFF, 2)) == 2);
  CHECK(refused(read(0x0480, 17)) == 3);
  CHECK(bus.read(Bus::last_error) == 0x8C);
  CHECK(refused(modbus::read_request(RegisterTable::input, {0x0480}, 1)) == 1);
  CHECK(bus.read(Bus::last_error) == 0x88);
  CHECK(refused(modbus::report_server_id_request()) == 1);
  CHECK(refused({0x08, {0, 1, 0x12, 0x34}}) == 1);
  CHECK(bus.ask(modbus::loopback_request(0x1234)) == modbus::loopback_request(0x1234));
  CHECK(bus.write(0x0481, 79) == 4);
  CHECK(bus.read(Bus::last_error) == 0x8C);
  CHECK(bus.write(0x0081, 1) == 2);
  CHECK(bus.write(0x0480, Registers(17, 0)) == 3);
}

TEST_CASE("blv driver: of communication errors the latest ten are kept, the newest first") {
  Bus bus;
  bus.write(0x0481, 79);
  for (int i = 0; i < 9; ++i) bus.ask(modbus::report_server_id_request());
  CHECK(bus.read(0x00AF) == 0x88);
  CHECK(bus.read(0x00C1) == 0x8C);
  bus.ask(modbus::report_server_id_request());
  CHECK(bus.read(0x00C1) == 0x88);
}

TEST_CASE("blv driver: pairs are written whole, by halves, and never half out of range") {
  Bus bus;
  CHECK(bus.write(0x0484, {0, 1000}) == 0);
  CHECK(bus.pair(0x0484) == 1000);
  CHECK(bus.write(0x0485, 900) == 0);
  CHECK(bus.pair(0x0484) == 900);
  CHECK(bus.write(0x0484, 1) == 4);  // 0x00010384
  CHECK(bus.pair(0x0484) == 900);
  CHECK(bus.write(0x0030, {0xFFFF, 0xFFFF}) == 0);
  CHECK(bus.pair(0x0030) == -1);
  CHECK(bus.write(0x0031, 1) == 4);  // 0xFFFF0001 is no address
  CHECK(bus.write(0x0030, {0, 2}) == 0);
}

TEST_CASE("blv driver: a function 10h that is refused has written what stands before") {
  Bus bus;
  CHECK(bus.write(0x0480, {0, 500, 0, 50, 0, 700}) == 4);
  CHECK(bus.pair(0x0480) == 500);
  CHECK(bus.pair(0x0482) == 0);
  CHECK(bus.pair(0x0484) == 1000);
}

TEST_CASE("blv driver: two-wire words run, ramp, reverse and stop the motor") {
  Bus bus;
  CHECK(bus.write(0x0485, 1000) == 0);
  CHECK(bus.write(0x0605, 10) == 0);  // one second up
  CHECK(bus.write(0x0685, 20) == 0);  // two seconds down
  CHECK(bus.write(Bus::command, 0x2A) == 0);
  CHECK(bus.shows(Bus::move));
  CHECK_FALSE(bus.shows(Bus::at_speed));
  bus.wait(500ms);
  CHECK(bus.pair(Bus::speed_now) == 500);
  bus.wait(500ms);
  CHECK(bus.pair(Bus::speed_now) == 1000);
  CHECK(bus.shows(Bus::at_speed));
  CHECK(bus.read(0x00C5) == 2);
  CHECK(bus.write(Bus::command, 0x32) == 0);
  bus.wait(2s);
  CHECK(bus.pair(Bus::speed_now) == 0);
  CHECK(bus.shows(Bus::move));
  bus.wait(1s);
  CHECK(bus.pair(Bus::speed_now) == -1000);
  CHECK(bus.write(Bus::command, 0x22) == 0);
  bus.wait(1s);
  CHECK(bus.pair(Bus::speed_now) == -500);
  CHECK(bus.shows(Bus::move));
  bus.wait(1s);
  CHECK_FALSE(bus.shows(Bus::move));
  CHECK(bus.write(Bus::command, 0x2A) == 0);
  bus.wait(1s);
  CHECK(bus.write(Bus::command, 0x02) == 0);
  CHECK_FALSE(bus.shows(Bus::move));
}

TEST_CASE("blv driver: both directions at once stop the motor") {
  Bus bus;
  bus.write(Bus::command, 0x2A);
  bus.wait(1s);
  bus.write(Bus::command, 0x3A);
  CHECK_FALSE(bus.shows(Bus::move));
}

TEST_CASE("blv driver: a speed that is changed while running is followed") {
  Bus bus;
  bus.write(Bus::command, 0x2A);
  bus.wait(1s);
  bus.write(0x0485, 2000);
  bus.wait(1s);
  CHECK(bus.pair(Bus::speed_now) == 2000);
  bus.write(0x0485, 0);
  bus.wait(1s);
  CHECK(bus.pair(Bus::speed_now) == 0);
}

TEST_CASE("blv driver: three wires count from Configuration on") {
  Bus bus;
  CHECK(bus.write(0x1040, {0, 1}) == 0);
  CHECK(bus.write(Bus::command, 0x12) == 0);  // still REV
  CHECK(bus.shows(Bus::move));
  CHECK(bus.write(0x018D, 1) == 4);  // not while it runs
  CHECK(bus.read(Bus::last_error) == 0x8D);
  CHECK(bus.write(Bus::command, 0x00) == 0);
  CHECK(bus.write(0x018D, 1) == 0);
  CHECK(bus.shows(Bus::busy));
  CHECK(bus.write(0x018D, 0) == 4);
  CHECK(bus.read(Bus::last_error) == 0x8A);
  bus.wait(1100ms);
  CHECK_FALSE(bus.shows(Bus::busy));
  CHECK(bus.write(0x018D, 0) == 0);
  CHECK(bus.write(Bus::command, 0x1A) == 0);
  bus.wait(1s);
  CHECK(bus.pair(Bus::speed_now) == 1000);
  CHECK(bus.write(Bus::command, 0x12) == 0);
  bus.wait(250ms);
  CHECK(bus.pair(Bus::speed_now) == 500);
  CHECK(bus.write(Bus::command, 0x3A) == 0);
  bus.wait(1s);
  CHECK(bus.pair(Bus::speed_now) == -1000);
  CHECK(bus.write(Bus::command, 0x0A) == 0);
  CHECK_FALSE(bus.shows(Bus::move));
}

// om_modbus_master, sample/cpp/BLV/sample3: Configuration by broadcast, the word 30 ms behind it.
TEST_CASE("blv driver: the maker's own programs run, however long Configuration takes") {
  for (const Duration configuring : {200ms, 1000ms}) {
    CAPTURE(configuring.count());
    Bus bus({.units = {1, 2}, .configuring = configuring});
    const auto broadcast = [&](std::uint16_t first, std::uint16_t value) {
      const Registers values = {0, value};
      CHECK_FALSE(bus.ask(modbus::write_request({first}, RegisterView(values)), 0));
      bus.wait(35ms);
    };
    broadcast(0x1040, 1);
    broadcast(0x0484, 0);
    broadcast(0x018C, 1);
    CHECK(bus.write(0x007C, {0, 26}, 1) == 0);
    bus.wait(60ms);
    CHECK(bus.write(0x007C, {0, 58}, 2) == 0);
    bus.wait(60ms);
    CHECK(bus.write(0x0484, {0, 500}, 1) == 0);
    CHECK(bus.write(0x0484, {0, 500}, 2) == 0);
    CHECK(bus.shows(Bus::busy));
    CHECK_FALSE(bus.shows(Bus::move));  // not excited while it configures itself
    bus.wait(2s);
    CHECK(bus.pair(Bus::speed_now, 1) == 500);
    CHECK(bus.pair(Bus::speed_now, 2) == -500);
    CHECK(bus.write(0x007C, {0, 18}, 1) == 0);
    CHECK(bus.write(0x007C, {0, 10}, 2) == 0);
    CHECK_FALSE(bus.shows(Bus::move, 2));
    bus.wait(1s);
    CHECK_FALSE(bus.shows(Bus::move, 1));
  }
}

TEST_CASE(
    "blv driver: Configuration takes 200 ms unless told otherwise, and parameters wait for it") {
  Bus bus;
  bus.write(0x018D, 1);
  CHECK(bus.tool->next_change() == bus.clock.now() + 200ms);
  CHECK(bus.write(0x1041, 1) == 4);
  CHECK(bus.read(Bus::last_error) == 0x8A);
  bus.wait(199ms);
  CHECK(bus.shows(Bus::busy));
  bus.wait(1ms);
  CHECK_FALSE(bus.shows(Bus::busy));
  CHECK(bus.write(0x1041, 1) == 0);
  Bus slow({.configuring = 1s});
  slow.write(0x018D, 1);
  slow.wait(999ms);
  CHECK(slow.shows(Bus::busy));
}

TEST_CASE("blv driver: alarms and warnings come by themselves, each at its time") {
  Bus bus({.units = {1, 2},
           .alarms = {{.code = 0x30, .after = 2s}},
           .warnings = {{.code = 0x25}, {.code = 0x30, .after = 1s}}});
  CHECK(bus.read(0x0097) == 0x25);
  CHECK(bus.tool->next_change() == bus.clock.now() + 1s);
  CHECK(bus.write(Bus::command, 0x2A) == 0);
  bus.wait(1s);
  CHECK(bus.read(0x0097) == 0x30);
  CHECK(bus.read(Bus::alarm) == 0);
  bus.wait(1s);
  CHECK(bus.read(Bus::alarm) == 0x30);
  CHECK(bus.read(Bus::alarm, 2) == 0x30);
  bus.wait(1s);
  CHECK_FALSE(bus.shows(Bus::move));
  bus.pulse(0x0181);
  CHECK(bus.read(Bus::alarm) == 0);  // once
  CHECK(bus.read(Bus::alarm, 2) == 0x30);
}

TEST_CASE("blv bus: a reboot is a power cycle of every driver") {
  Bus bus({.units = {1, 2}});
  for (const std::uint8_t unit : {std::uint8_t{1}, std::uint8_t{2}}) {
    CAPTURE(unit);
    bus.write(0x0485, 1100, unit);
    CHECK(bus.write(0x0193, 1, unit) == 0);
  }
  bus.wait(1s);
  bus.tool->raise_alarm(1, 0x30, bus.clock.now());
  bus.tool->raise_warning(1, 0x25, bus.clock.now());
  bus.write(0x0485, 1300);
  bus.write(0x1201, 5000);
  bus.write(0x0030, {0, 2});
  bus.write(Bus::command, 0x2A, 2);
  bus.wait(1s);
  CHECK(bus.shows(Bus::move, 2));
  bus.ask(modbus::report_server_id_request());
  bus.tool->reboot(bus.clock.now());
  CHECK(bus.pair(0x0484) == 1100);  // what was saved
  CHECK(bus.pair(0x1200) == 0);     // what was not
  CHECK(bus.pair(0x0030) == -1);
  CHECK(bus.pair(0x007C, 2) == 0);
  CHECK(bus.read(0x0193) == 0);
  CHECK_FALSE(bus.shows(Bus::move, 2));
  CHECK(bus.read(Bus::alarm) == 0);
  CHECK(bus.read(0x0097) == 0);
  CHECK(bus.read(0x0083) == 0x30);  // the alarm history stays
  CHECK(bus.read(0x0099) == 0);     // the others are in RAM
  CHECK(bus.read(0x00AF) == 0);
  CHECK(bus.read(Bus::last_error) == 0);
}

TEST_CASE("blv driver: data 0 and 1 follow the analog value until digital is configured") {
  Bus bus;
  bus.write(0x0481, 1500);
  bus.write(Bus::command, 0x28);
  bus.wait(1s);
  CHECK(bus.pair(Bus::speed_now) == 600);
  bus.write(Bus::command, 0x00);
  bus.write(0x10E3, 1);
  bus.write(Bus::command, 0x28);
  bus.wait(1s);
  CHECK(bus.pair(Bus::speed_now) == 600);
  bus.write(Bus::command, 0x00);
  bus.pulse(0x018D);
  bus.write(Bus::command, 0x28);
  bus.wait(1s);
  CHECK(bus.pair(Bus::speed_now) == 1500);
}

TEST_CASE("blv driver: maintenance commands act on the edge only") {
  Bus bus;
  bus.tool->raise_alarm(1, 0x30, bus.clock.now());
  CHECK(bus.write(0x0181, 1) == 0);
  CHECK(bus.read(Bus::alarm) == 0);
  bus.tool->raise_alarm(1, 0x30, bus.clock.now());
  CHECK(bus.write(0x0181, 1) == 0);
  CHECK(bus.read(Bus::alarm) == 0x30);  // it stayed at 1
  CHECK(bus.write(0x0181, 2) == 4);
  CHECK(bus.write(0x0181, 0) == 0);
  CHECK(bus.write(0x0181, 1) == 0);
  CHECK(bus.read(Bus::alarm) == 0);
  CHECK(bus.read(0x0083) == 0x30);
  CHECK(bus.read(0x0085) == 0x30);
}

TEST_CASE("blv driver: an alarm lets the motor coast, and after the reset the word counts again") {
  Bus bus;
  bus.write(Bus::command, 0x2A);
  bus.wait(1s);
  bus.tool->raise_alarm(1, 0x30, bus.clock.now());
  CHECK(bus.shows(Bus::move));
  bus.wait(1s);
  CHECK_FALSE(bus.shows(Bus::move));
  bus.write(Bus::command, 0x2A);
  CHECK_FALSE(bus.shows(Bus::move));
  SUBCASE("a word that still runs starts it again") {
    bus.pulse(0x0181);
    CHECK(bus.shows(Bus::move));
  }
  SUBCASE("a word that was cleared does not") {
    bus.write(Bus::command, 0x02);
    bus.pulse(0x0181);
    CHECK_FALSE(bus.shows(Bus::move));
  }
}

TEST_CASE("blv driver: three alarms end only with the power") {
  for (const std::uint8_t code : {std::uint8_t{0x20}, std::uint8_t{0x41}, std::uint8_t{0x83}}) {
    CAPTURE(code);
    Bus bus;
    bus.tool->raise_alarm(1, code, bus.clock.now());
    bus.pulse(0x0181);
    CHECK(bus.read(Bus::alarm) == code);
    bus.tool->power_cycle(1, bus.clock.now());
    CHECK(bus.read(Bus::alarm) == 0);
    CHECK(bus.read(0x0083) == code);
  }
  Bus bus;
  bus.tool->raise_alarm(1, 0x41, bus.clock.now());
  CHECK(bus.write(0x0193, 1) == 4);
  CHECK(bus.read(Bus::last_error) == 0x8A);
}

TEST_CASE("blv driver: the watchdog stops a motor when no master asks any more") {
  Bus bus;
  bus.write(0x1201, 500);
  bus.write(Bus::command, 0x2A);
  for (int i = 0; i < 10; ++i) {
    bus.wait(400ms);
    CHECK(bus.shows(Bus::move));
  }
  REQUIRE(bus.tool->next_change() == bus.clock.now() + 500ms);
  bus.wait(3s);
  CHECK_FALSE(bus.shows(Bus::move));
  CHECK(bus.read(Bus::alarm) == 0x85);
  CHECK(bus.read(0x0083) == 0x85);
  CHECK(bus.read(0x0085) == 0);
}

TEST_CASE("blv driver: without a watchdog the motor runs for ever") {
  Bus bus;
  bus.write(Bus::command, 0x2A);
  bus.wait(1h);
  CHECK(bus.shows(Bus::move));
  CHECK(bus.read(Bus::alarm) == 0);
}

TEST_CASE("blv driver: bad frames warn, then stop the motor") {
  Bus bus;
  bus.write(Bus::command, 0x2A);
  bus.tool->bad_frame(bus.clock.now());
  bus.tool->bad_frame(bus.clock.now());
  CHECK(bus.read(0x0099) == 0x84);  // warning history; the good frame ended the warning itself
  CHECK(bus.read(0x0097) == 0);
  CHECK(bus.read(Bus::alarm) == 0);
  for (int i = 0; i < 3; ++i) bus.tool->bad_frame(bus.clock.now());
  bus.wait(2s);
  CHECK(bus.read(Bus::alarm) == 0x84);
  CHECK_FALSE(bus.shows(Bus::move));
  CHECK(bus.read(0x00AF) == 0x84);
}

TEST_CASE("blv driver: only what was saved outlives the power") {
  Bus bus;
  bus.write(0x0485, 1100);
  bus.write(0x0193, 1);
  CHECK(bus.write(0x0487, 1200) == 4);  // it is busy with the memory
  CHECK(bus.read(Bus::last_error) == 0x8A);
  bus.wait(1s);
  CHECK(bus.write(0x0487, 1200) == 0);
  bus.write(0x0193, 0);
  bus.write(0x0030, {0, 2});
  bus.write(0x1201, 800);
  bus.tool->power_cycle(1, bus.clock.now());
  CHECK(bus.pair(0x0484) == 1100);
  CHECK(bus.pair(0x0486) == 0);
  CHECK(bus.pair(0x0030) == -1);
  CHECK(bus.pair(0x1200) == 0);
  CHECK(bus.pair(0x007C) == 0);
}

TEST_CASE("blv driver: load and initialize take the memory's and the factory's values") {
  Bus bus;
  bus.write(0x0485, 1100);
  bus.write(0x1407, 0);
  bus.write(0x1201, 5000);
  bus.write(0x1203, 7);
  bus.pulse(0x0193);
  bus.write(0x0485, 1200);
  bus.pulse(0x0191);
  CHECK(bus.pair(0x0484) == 1100);
  bus.pulse(0x018F);
  CHECK(bus.pair(0x0484) == 1000);
  CHECK(bus.pair(0x1406) == 0);  // spared, with stop bits and waiting time
  CHECK(bus.pair(0x1200) == 0);
  CHECK(bus.pair(0x1202) == 3);
  bus.pulse(0x0195);
  CHECK(bus.pair(0x1406) == 1);
}

TEST_CASE("blv driver: the setter keeps all masters from writing") {
  Bus bus;
  bus.tool->use_setter(1, bus.clock.now() + 2s);
  CHECK(bus.write(0x0485, 1100) == 4);
  CHECK(bus.read(Bus::last_error) == 0x89);
  bus.wait(2s);
  CHECK(bus.write(0x0485, 1100) == 0);
}

TEST_CASE("blv bus: other units are silent, a broadcast is done by all and answered by none") {
  Bus bus({.units = {1, 2, 5}});
  CHECK_FALSE(bus.ask(modbus::loopback_request(1), 3));
  CHECK(bus.tool->answers_to({5}));
  CHECK_FALSE(bus.tool->answers_to({0}));
  CHECK_FALSE(bus.ask(modbus::write_request({0x0485}, 1300), 0));
  for (const std::uint8_t unit : {std::uint8_t{1}, std::uint8_t{2}, std::uint8_t{5}}) {
    CHECK(bus.pair(0x0484, unit) == 1300);
  }
  CHECK_FALSE(bus.ask(modbus::loopback_request(1), 0));
}

TEST_CASE("blv bus: children do what is written to their parent with function 10h") {
  Bus bus({.units = {1, 2, 3}});
  bus.write(0x0030, {0, 1}, 2);
  CHECK(bus.write(0x0484, {0, 1400}, 1) == 0);
  CHECK(bus.pair(0x0484, 1) == 1400);
  CHECK(bus.pair(0x0484, 2) == 1400);
  CHECK(bus.pair(0x0484, 3) == 1000);
  CHECK(bus.write(0x0485, 1500, 1) == 0);  // function 06h reaches the parent alone
  CHECK(bus.pair(0x0484, 2) == 1400);
  CHECK(bus.write(0x0484, {0, 1600}, 2) == 0);  // a child still has its own address
  CHECK(bus.pair(0x0484, 2) == 1600);
  CHECK(bus.pair(0x0484, 1) == 1500);
  bus.write(0x0030, {0xFFFF, 0xFFFF}, 2);
  bus.write(0x0484, {0, 1700}, 1);
  CHECK(bus.pair(0x0484, 2) == 1600);
}

TEST_CASE("blv bus: it wants silence before a query, and takes its time to answer") {
  Bus bus;
  CHECK(bus.tool->required_gap() == 5500us);
  CHECK(bus.tool->answer_delay({1}) == 10ms);
  CHECK(Bus({.baud = 19200}).tool->required_gap() == 5500us);
  CHECK(Bus({.baud = 115200}).tool->required_gap() == 3500us);
  bus.write(0x140B, 5);
  bus.pulse(0x018D);
  CHECK(bus.tool->answer_delay({1}) == 10ms);
  bus.pulse(0x0193);
  bus.tool->power_cycle(1, bus.clock.now());
  CHECK(bus.tool->answer_delay({1}) == 500us);
}

// Protocol notes, section 2.1: frames as computed there, asked of the simulated driver.
TEST_CASE("blv bus: golden frames") {
  struct Exchange {
    const char* query;
    const char* response;
  };
  const Exchange exchanges[] = {
      {"01 10 04 84 00 02 04 00 00 03 E8 C8 42", "01 10 04 84 00 02 00 D1"},
      {"01 06 04 85 03 E8 99 AD", "01 06 04 85 03 E8 99 AD"},
      {"01 06 00 7D 00 2A 98 0D", "01 06 00 7D 00 2A 98 0D"},
      {"01 06 00 7D 00 22 99 CB", "01 06 00 7D 00 22 99 CB"},
      {"01 10 00 7C 00 02 04 00 00 00 12 74 D3", "01 10 00 7C 00 02 80 10"},
      {"01 06 00 7D 00 00 19 D2", "01 06 00 7D 00 00 19 D2"},
      {"01 10 10 40 00 02 04 00 00 00 01 FB 9F", "01 10 10 40 00 02 44 DC"},
      {"01 10 12 00 00 02 04 00 00 03 E8 27 B1", "01 10 12 00 00 02 44 B0"},
      {"01 06 10 E3 00 01 BD 3C", "01 06 10 E3 00 01 BD 3C"},
      {"01 06 01 81 00 01 19 DE", "01 06 01 81 00 01 19 DE"},
      {"01 06 01 81 00 00 D8 1E", "01 06 01 81 00 00 D8 1E"},
      {"01 03 04 80 00 11 85 1E", "01 83 03 01 31"},
      {"02 10 00 30 00 02 04 00 00 00 01 3E 3F", "02 10 00 30 00 02 41 F4"},
      {"02 10 00 30 00 02 04 FF FF FF FF FE 6B", "02 10 00 30 00 02 41 F4"},
      {"00 06 00 7D 00 20 19 DB", ""},
  };
  Bus bus({.units = {1, 2}});
  for (const Exchange& exchange : exchanges) {
    CAPTURE(exchange.query);
    const Bytes query = test::hex(exchange.query);
    const auto deframed = modbus::deframe(modbus::Framing::rtu, modbus::Role::server, query);
    const auto* frame = std::get_if<modbus::Deframed>(&deframed);
    REQUIRE(frame != nullptr);
    CHECK(frame->consumed == query.size());
    CHECK(modbus::frame(modbus::Framing::rtu, frame->adu) == query);
    const auto answer = bus.ask(frame->adu.pdu, frame->adu.unit.value);
    const Bytes sent =
        answer ? modbus::frame(modbus::Framing::rtu, {{}, frame->adu.unit, *answer}) : Bytes();
    CHECK(to_hex(sent) == exchange.response);
    bus.wait(100ms);
  }
}
