#include <doctest/doctest.h>

#include <chrono>

#include "spindle/catalogue/value.hpp"
#include "spindle/device/device.hpp"
#include "support/blv_bench.hpp"

namespace {

using namespace spindle;
using namespace std::chrono_literals;
using device::ActionResult;
using device::WriteResult;
using test::BlvBench;

catalogue::Action action(const BlvBench& bench, std::string_view name) {
  return bench.profile.find_action(name).value();
}

device::Written set(BlvBench& bench, device::Device& device, const char* name, const char* text) {
  const auto parameter = bench.profile.find(name).value();
  const auto before = device.read_each({parameter}, device::Limits::skip).value().front();
  return device.write(before.parameter, before.value.value(),
                      catalogue::Value{*Decimal::parse(text), {}});
}

}  // namespace

TEST_CASE("blv device: a pair is written whole and read back") {
  BlvBench bench;
  auto device = bench.open().value();
  CHECK(set(bench, device, "operation.2.speed", "1234").result == WriteResult::written);
  CHECK(bench.read(0x0484) == 0);
  CHECK(bench.read(0x0485) == 1234);
}

TEST_CASE("blv device: a refusal says what the driver says of it") {
  BlvBench bench;
  auto device = bench.open().value();
  const auto refused = set(bench, device, "operation.2.speed", "50");
  REQUIRE(refused.result == WriteResult::refused);
  CHECK_FALSE(refused.may_have_changed());
  CHECK(refused.error->exception == 4);
  CHECK(refused.error->device_code == 0x8C);
  CHECK(refused.error->message.find("value outside the setting range") != std::string::npos);
  CHECK(refused.error->hint == "'spindle list' shows ranges");
}

TEST_CASE("blv device: a busy driver is waited for, with a limit") {
  BlvBench bench;
  auto device = bench.open().value();
  bench.bus->use_setter(1, bench.clock.now() + 2s);
  CHECK(set(bench, device, "operation.2.speed", "900").result == WriteResult::written);
  bench.bus->use_setter(1, bench.clock.now() + 60s);
  const TimePoint began = bench.clock.now();
  const auto refused = set(bench, device, "operation.2.speed", "800");
  REQUIRE(refused.result == WriteResult::refused);
  CHECK_FALSE(refused.may_have_changed());
  CHECK(refused.error->device_code == 0x89);
  CHECK(bench.clock.now() - began > 4s);
  CHECK(bench.clock.now() - began < 6s);
  CHECK(bench.read(0x0485) == 900);
}

TEST_CASE("blv device: an alarm is reset as an edge, with the run bits cleared first") {
  BlvBench bench;
  auto device = bench.open().value();
  bench.write(0x0181, 1);  // somebody left it there
  bench.write(0x007D, 0x2A);
  bench.clock.advance(1s);
  bench.bus->raise_alarm(1, 0x30, bench.clock.now());
  bench.clock.advance(2s);
  CHECK(device.perform(action(bench, "alarm-reset"), 1) == ActionResult::confirmed);
  CHECK(bench.read(0x0081) == 0);
  CHECK(bench.read(0x0181) == 0);
  CHECK(bench.read(0x007D) == 0x22);
  CHECK_FALSE(bench.moves());
}

TEST_CASE("blv device: an alarm is reset without a motor that starts, whatever the inputs do") {
  struct Row {
    std::uint16_t input;     ///< register of its function
    std::uint16_t function;  ///< 77 is one that nobody knows
    std::uint16_t word;
    std::uint16_t left;
  };
  const Row rows[] = {{0x116B, 1, 0x2A, 0x02}, {0x116B, 77, 0x2A, 0x02}, {0x1163, 1, 0x02, 0x00}};
  for (const Row& row : rows) {
    CAPTURE(row.input);
    CAPTURE(row.function);
    BlvBench bench;
    bench.write(0x0481, 1000);
    auto device = bench.open().value();
    bench.write(row.input, row.function);
    bench.write(0x007D, row.word);
    bench.bus->raise_alarm(1, 0x30, bench.clock.now());
    bench.clock.advance(2s);
    CHECK(device.perform(action(bench, "alarm-reset"), 1) == ActionResult::confirmed);
    CHECK(bench.read(0x007D) == row.left);
    CHECK_FALSE(bench.moves());
  }
}

TEST_CASE("blv device: without an alarm nothing is reset, and a running motor runs on") {
  BlvBench bench;
  auto device = bench.open().value();
  bench.write(0x007D, 0x2A);
  CHECK(device.perform(action(bench, "alarm-reset"), 1) == ActionResult::confirmed);
  CHECK(bench.moves());
  CHECK(bench.read(0x007D) == 0x2A);
}

TEST_CASE("blv device: an alarm that only the power ends is not confirmed") {
  BlvBench bench;
  auto device = bench.open().value();
  bench.bus->raise_alarm(1, 0x83, bench.clock.now());
  CHECK(device.perform(action(bench, "alarm-reset"), 1) == ActionResult::not_confirmed);
}

TEST_CASE("blv device: saving is over when the driver is ready again") {
  BlvBench bench;
  auto device = bench.open().value();
  bench.write(0x0485, 777);
  const TimePoint began = bench.clock.now();
  CHECK(device.perform(action(bench, "save"), 1) == ActionResult::finished);
  CHECK(bench.clock.now() - began > 500ms);
  CHECK(bench.read(0x0193) == 0);
  bench.bus->power_cycle(1, bench.clock.now());
  CHECK(bench.read(0x0485) == 777);
}

TEST_CASE("blv device: what cannot be done now is refused with the reason") {
  BlvBench bench;
  auto device = bench.open().value();
  bench.write(0x007D, 0x2A);
  const auto refused = device.perform(action(bench, "configure"), 1);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().device_code == 0x8D);
  CHECK(refused.error().name == "configure");
}

TEST_CASE("blv device: a group needs both words") {
  BlvBench bench;
  auto device = bench.open().value();
  CHECK(device.perform(action(bench, "group"), 5) == ActionResult::confirmed);
  CHECK(bench.read(0x0031) == 5);
  CHECK(device.perform(action(bench, "group"), -1) == ActionResult::confirmed);
  CHECK(bench.read(0x0030) == 0xFFFF);
  CHECK(bench.read(0x0031) == 0xFFFF);
}

TEST_CASE("blv device: names of bits are those of the input mode that is set") {
  BlvBench bench;
  auto device = bench.open().value();
  const auto word = bench.profile.find("command.driver-input").value();
  bench.write(0x007D, 0x2A);
  CHECK(device.read_each({word}, device::Limits::skip)->front().value->label == "M1 FWD STOP-MODE");
  bench.write(0x007D, 0);
  bench.configure(0x1040, 1);
  bench.write(0x007D, 0x3A);
  CHECK(device.read_each({word}, device::Limits::skip)->front().value->label ==
        "M1 START/STOP RUN/BRAKE FWD/REV");
}

TEST_CASE("blv device: a broadcast reaches all, and an edge of it too") {
  BlvBench bench({.units = {1, 2}});
  auto device = bench.open(0).value();
  const auto speed = bench.profile.find("operation.2.speed").value();
  REQUIRE(device.broadcast(speed, catalogue::Value{Decimal(1500), {}}));
  CHECK(bench.read(0x0485, 1) == 1500);
  CHECK(bench.read(0x0485, 2) == 1500);
  bench.write(0x1041, 1, 2);
  REQUIRE(device.broadcast(action(bench, "configure"), 1));
  CHECK(bench.read(0x018D, 2) == 0);
  bench.write(0x007D, 0x1A, 2);
  CHECK(bench.moves(2));
}
