#include <doctest/doctest.h>

#include <bit>
#include <cmath>
#include <string>
#include <vector>

#include "sim/gen2_event.hpp"
#include "spindle/modbus/pdu.hpp"
#include "support/rig.hpp"
#include "unit/hex.hpp"

using namespace spindle;
using namespace spindle::sim;
using namespace std::chrono_literals;
using modbus::RegisterTable;

namespace {

constexpr std::uint16_t start = 5000;
constexpr std::uint16_t direction = 5001;
constexpr std::uint16_t output = 5350;
constexpr std::uint16_t event_select = 3682;
constexpr std::uint16_t auto_output = 3718;
constexpr std::size_t block_size = 214;
constexpr ConnectionId client{99};  // whose requests a rig sends past the wire
constexpr ConnectionId other{7};

const test::Product& gen2() {
  static const test::Product product = test::product("doga-gen2");
  return product;
}

/// Where things stand in the 214 bytes of an event.
struct Told {
  ByteView block;

  [[nodiscard]] std::uint16_t word(std::size_t at) const { return get_u16(block, at); }
  [[nodiscard]] float real(std::size_t at) const {
    return std::bit_cast<float>(std::uint32_t{word(at)} << 16U | word(at + 2));
  }
  [[nodiscard]] std::uint16_t number() const { return word(2); }
  [[nodiscard]] std::uint16_t status() const { return word(24); }
  [[nodiscard]] std::string barcode() const {
    std::string text(block.begin() + 76, block.begin() + 76 + 64);
    return text.substr(0, text.find('\0'));
  }
};

struct Bench : test::DeviceRig {
  explicit Bench(const DeviceOptions& how = {}) : Rig(gen2(), how) {
    tool->connected(client);
    tool->connected(other);
  }

  /// What was sent unasked since then, to this client.
  std::vector<Bytes> pushed(ConnectionId to = client) {
    std::vector<Bytes> blocks;
    for (const Push& push : tool->take_pushes(to)) {
      const Bytes& data = push.pdu.data;
      const std::size_t length_bytes = push.pdu.function == 0x04 ? 1 : 2;
      REQUIRE(data.size() >= length_bytes + 4);
      if (push.pdu.function == 0x64) continue;  // a curve
      REQUIRE(data.size() >= length_bytes + block_size);
      CHECK((push.pdu.function == 0x66 || data.size() == length_bytes + block_size));
      const auto begin = data.begin() + static_cast<std::ptrdiff_t>(length_bytes);
      blocks.emplace_back(begin, begin + static_cast<std::ptrdiff_t>(block_size));
    }
    return blocks;
  }

  float real(RegisterTable table, std::uint16_t first) {
    const Registers words = registers(table, first, 2);
    return std::bit_cast<float>(std::uint32_t{words[0]} << 16U | words[1]);
  }

  std::string text(std::uint16_t first, std::uint16_t count) {
    std::string characters;
    for (const std::uint16_t word : registers(RegisterTable::input, first, count)) {
      characters += static_cast<char>(word >> 8U);
      characters += static_cast<char>(word & 0xFFU);
    }
    return characters.substr(0, characters.find('\0'));
  }

  /// One screw, and what was sent of it.
  Bytes drive() {
    write(output, 1);
    write(start, 1);
    wait(3s);
    const auto blocks = pushed();
    REQUIRE(blocks.size() == 1);
    return blocks.front();
  }
};

}  // namespace

TEST_CASE("gen2: the identity block says in texts and numbers what function 11h says") {
  Bench bench;
  CHECK(bench.text(3, 16) == "BMT3216");
  CHECK(bench.text(19, 5) == "2401190042");
  CHECK(bench.registers(RegisterTable::input, 46, 3) == Registers{4, 0, 2});
  Bench later({.firmware = 4123, .serial = 2501290007});
  CHECK(later.text(3, 16) == "BMT403216");
  CHECK(later.text(41, 5) == "2501290007");
  CHECK(later.registers(RegisterTable::input, 46, 3) == Registers{4, 12, 3});
}

TEST_CASE("gen2: the event of the facts has the bytes of the facts") {
  // gen2_frames.txt: "pushed event as FC 04".
  const Gen2Event event{.number = 1962,
                        .date = {2026, 5, 28, 14, 30, 45, 12},
                        .fastening_time = 1421,
                        .preset = 1,
                        .torque_unit = 2,
                        .screws_remaining = 3,
                        .status = 1,
                        .target_torque = 2.0F,
                        .torque = 2.0625F,
                        .speed = 235,
                        .a1 = 1058,
                        .a2 = 399,
                        .a3 = 1457,
                        .barcode = "WO-1234",
                        .curves = {{{1, 4}, {4, 4}}},
                        .sampling = 5,
                        .steps = {{{4, 0}, {5, 1}, {10, 3}}}};
  Bytes wanted = test::hex(
      "D6 0001 07AA 07EA 051C 0E1E 2D0C 058D 0001 0002 0003 0000 0000 0001 40000000 40040000 "
      "00000000 00000000 00000000 00000000 00EB 0422 018F 05B1 0000 0000000000000000000000000000 "
      "0000 574F2D31323334");
  wanted.resize(1 + 140, 0);
  const Bytes end = test::hex("0001 0004 0004 0004 0005 0004 0000 0005 0001 000A 0003");
  wanted.insert(wanted.end(), end.begin(), end.end());
  wanted.resize(1 + 214, 0);
  const modbus::Pdu frame =
      modbus::read_response(modbus::RegisterTable::input, sim::block_of(event));
  CHECK((frame.function == 4 && frame.data == wanted));
}

TEST_CASE("gen2: it answers as unit 1 whatever unit is asked") {
  Bench bench;
  for (const std::uint8_t unit : Bytes{0, 1, 77})
    CHECK(bench.tool->answering_unit({unit}).value == 1);
  // A screwdriver with older firmware repeats the unit that was asked.
  test::DeviceRig older(test::product("doga-bm"), DeviceOptions{});
  CHECK(older.tool->answering_unit({77}).value == 77);
}

TEST_CASE("gen2: a screw is told in one frame to those who are armed") {
  Bench bench;
  const Bytes block = bench.drive();
  CHECK(bench.pushed(other).empty());
  const Told told{block};
  CHECK(told.word(0) == 1);
  CHECK(told.number() == 1);
  CHECK(told.word(4) == 2026);
  CHECK((told.word(6) == 0x0101 && told.word(8) == 0));
  CHECK(told.word(14) == 1);
  CHECK(told.word(16) == 2);
  CHECK(told.status() == 1);
  CHECK(told.real(26) == 3.0F);
  CHECK((told.real(30) >= 3.0F && told.real(30) < 3.1F));
  CHECK(told.word(50) == 420);
  CHECK(told.word(52) + told.word(54) == told.word(56));
  CHECK(told.barcode() == "WO-1234");
}

TEST_CASE("gen2: its clock goes on") {
  Bench bench;
  bench.read(start);
  bench.wait(25h + 61s);
  const Bytes block = bench.drive();
  CHECK(Told{block}.word(6) == 0x0102);
  CHECK(Told{block}.word(8) == 0x0101);
}

TEST_CASE("gen2: the output that was armed expires, and the setting sends to everybody") {
  Bench bench;
  bench.write(output, 1);
  bench.wait(11s);
  bench.write(start, 1);
  bench.wait(3s);
  CHECK(bench.pushed().empty());
  CHECK(bench.write(auto_output, 1) == 0);
  bench.write(start, 1);
  bench.wait(3s);
  CHECK(bench.pushed().size() == 1);
  CHECK(bench.pushed(other).size() == 1);
}

TEST_CASE("gen2: a direction is echoed and not taken while the spindle turns or runs down") {
  Bench bench;
  bench.write(start, 1);
  bench.wait(100ms);
  CHECK(bench.read_input(110) == 1);
  CHECK(bench.write(direction, 1) == 0);
  CHECK((bench.read(direction) == 0 && bench.read_input(112) == 0));
  bench.write(start, 0);
  CHECK(bench.read_input(110) == 0);
  bench.wait(200ms);
  CHECK(bench.write(direction, 1) == 0);
  CHECK(bench.read(direction) == 0);
  bench.wait(60ms);
  CHECK(bench.write(direction, 1) == 0);
  CHECK((bench.read(direction) == 1 && bench.read_input(112) == 1));
}

TEST_CASE("gen2: a run that is stopped early is an NG result with its error") {
  Bench bench;
  bench.write(output, 1);
  bench.write(start, 1);
  bench.wait(500ms);
  CHECK(bench.real(RegisterTable::input, 103) > 0);
  bench.write(start, 0);
  const auto blocks = bench.pushed();
  REQUIRE(blocks.size() == 1);
  CHECK(Told{blocks.front()}.status() == 2);
  CHECK(Told{blocks.front()}.word(22) == 333);
}

TEST_CASE("gen2: the event number goes on from what is said, and wraps") {
  Bench bench({.event_number = 65534});
  CHECK(Told{bench.drive()}.number() == 65535);
  CHECK(Told{bench.drive()}.number() == 0);
}

TEST_CASE("gen2: an event without a date, and one whose torque is no number") {
  Bench bench({.faults = test::plan_of({"zero-date@1", "not-a-number@2"})});
  const Bytes undated = bench.drive();
  for (std::size_t at = 4; at < 12; ++at) CHECK(undated[at] == 0);
  CHECK(Told{undated}.real(30) > 0);
  CHECK(std::isnan(Told{bench.drive()}.real(30)));
  CHECK(std::isnan(bench.real(RegisterTable::input, 100)));
  CHECK(Told{bench.drive()}.real(30) > 0);
  CHECK(bench.real(RegisterTable::input, 100) == 0);
}

TEST_CASE("gen2: only events that are selected are kept and counted") {
  Bench bench;
  CHECK(bench.write(event_select, 0) == 0);
  bench.write(output, 1);
  bench.write(start, 1);
  bench.wait(3s);
  CHECK(bench.pushed().empty());
  CHECK(bench.write(event_select, 0x3FF) == 0);
  bench.write(direction, 1);
  const auto blocks = bench.pushed();
  REQUIRE(blocks.size() == 1);
  CHECK((Told{blocks.front()}.number() == 1 && Told{blocks.front()}.status() == 3));
}

TEST_CASE("gen2: a barcode that is scanned stands in what follows") {
  Bench bench;
  CHECK(bench.write(event_select, 0x3FF) == 0);
  bench.write(output, 1);
  bench.tool->happen(catalogue::EventKind::barcode, bench.clock.now());
  const auto blocks = bench.pushed();
  REQUIRE(blocks.size() == 1);
  CHECK((Told{blocks.front()}.status() == 7 && Told{blocks.front()}.barcode() == "WO-1235"));
  CHECK(Told{bench.drive()}.barcode() == "WO-1235");
}

TEST_CASE("gen2: with an alarm nothing starts until it is switched off and on") {
  Bench bench;
  bench.tool->raise_alarm(1, 116, bench.clock.now());
  bench.write(start, 1);
  CHECK((bench.read_input(110) == 0 && bench.read_input(111) == 116 && bench.read_input(109) == 0));
  bench.tool->power_cycle(1, bench.clock.now());
  bench.write(start, 1);
  CHECK((bench.read_input(110) == 1 && bench.read_input(111) == 0));
}

TEST_CASE("gen2: what is not listed is not there") {
  Bench bench;
  CHECK(bench.write(4003, 1) == 2);
  CHECK(bench.write(23, 1) == 2);
  CHECK(bench.write(direction, 2) == 0x0E);
}
