#include <doctest/doctest.h>

#include <chrono>

#include "spindle/catalogue/value.hpp"
#include "spindle/device/device.hpp"
#include "support/rig.hpp"

namespace {

using namespace spindle;
using namespace std::chrono_literals;
using device::ActionResult;
using device::WriteResult;
using test::BlvRig;

catalogue::Action action(const BlvRig& rig, std::string_view name) {
  return rig.profile.find_action(name).value();
}

device::Written set(BlvRig& rig, device::Device& device, const char* name, const char* text) {
  const auto parameter = rig.profile.find(name).value();
  const auto before = device.read_each({parameter}, device::Limits::skip).value().front();
  return device.write(before.parameter, before.value.value(),
                      catalogue::Value{*Decimal::parse(text), {}});
}

}  // namespace

TEST_CASE("blv device: a pair is written whole and read back") {
  BlvRig rig;
  auto device = rig.open();
  CHECK(set(rig, device, "operation.2.speed", "1234").result == WriteResult::written);
  CHECK(rig.read(0x0484) == 0);
  CHECK(rig.read(0x0485) == 1234);
}

TEST_CASE("blv device: a refusal says what the driver says of it") {
  BlvRig rig;
  auto device = rig.open();
  const auto refused = set(rig, device, "operation.2.speed", "50");
  REQUIRE(refused.result == WriteResult::refused);
  CHECK_FALSE(refused.may_have_changed());
  CHECK(refused.error->exception == 4);
  CHECK(refused.error->device_code == 0x8C);
  CHECK(refused.error->message.find("value outside the setting range") != std::string::npos);
  CHECK(refused.error->hint == "'spindle list' shows ranges");
}

TEST_CASE("blv device: a busy driver is waited for, with a limit") {
  BlvRig rig;
  auto device = rig.open();
  rig.tool->use_setter(1, rig.clock.now() + 2s);
  CHECK(set(rig, device, "operation.2.speed", "900").result == WriteResult::written);
  rig.tool->use_setter(1, rig.clock.now() + 60s);
  const TimePoint began = rig.clock.now();
  const auto refused = set(rig, device, "operation.2.speed", "800");
  REQUIRE(refused.result == WriteResult::refused);
  CHECK_FALSE(refused.may_have_changed());
  CHECK(refused.error->device_code == 0x89);
  CHECK(rig.clock.now() - began > 4s);
  CHECK(rig.clock.now() - began < 6s);
  CHECK(rig.read(0x0485) == 900);
}

TEST_CASE("blv device: an alarm is reset as an edge, with the run bits cleared first") {
  BlvRig rig;
  auto device = rig.open();
  rig.write(0x0181, 1);  // another master left it there
  rig.write(0x007D, 0x2A);
  rig.clock.advance(1s);
  rig.tool->raise_alarm(1, 0x30, rig.clock.now());
  rig.clock.advance(2s);
  CHECK(device.perform(action(rig, "alarm-reset"), 1) == ActionResult::confirmed);
  CHECK(rig.read(0x0081) == 0);
  CHECK(rig.read(0x0181) == 0);
  CHECK(rig.read(0x007D) == 0x22);
  CHECK_FALSE(rig.moves());
}

TEST_CASE("blv device: an alarm is reset without a motor that starts, whatever the inputs do") {
  struct Row {
    std::uint16_t input;     ///< register of its function
    std::uint16_t function;  ///< 77 is not in any manual
    std::uint16_t word;
    std::uint16_t left;
  };
  const Row rows[] = {{0x116B, 1, 0x2A, 0x02}, {0x116B, 77, 0x2A, 0x02}, {0x1163, 1, 0x02, 0x00}};
  for (const Row& row : rows) {
    CAPTURE(row.input);
    CAPTURE(row.function);
    BlvRig rig;
    rig.write(0x0481, 1000);
    auto device = rig.open();
    rig.write(row.input, row.function);
    rig.write(0x007D, row.word);
    rig.tool->raise_alarm(1, 0x30, rig.clock.now());
    rig.clock.advance(2s);
    CHECK(device.perform(action(rig, "alarm-reset"), 1) == ActionResult::confirmed);
    CHECK(rig.read(0x007D) == row.left);
    CHECK_FALSE(rig.moves());
  }
}

TEST_CASE("blv device: without an alarm nothing is reset, and a running motor runs on") {
  BlvRig rig;
  auto device = rig.open();
  rig.write(0x007D, 0x2A);
  CHECK(device.perform(action(rig, "alarm-reset"), 1) == ActionResult::confirmed);
  CHECK(rig.moves());
  CHECK(rig.read(0x007D) == 0x2A);
}

TEST_CASE("blv device: an alarm that only the power ends is not confirmed") {
  BlvRig rig;
  auto device = rig.open();
  rig.tool->raise_alarm(1, 0x83, rig.clock.now());
  CHECK(device.perform(action(rig, "alarm-reset"), 1) == ActionResult::not_confirmed);
}

TEST_CASE("blv device: saving is over when the driver is ready again") {
  BlvRig rig;
  auto device = rig.open();
  rig.write(0x0485, 777);
  const TimePoint began = rig.clock.now();
  CHECK(device.perform(action(rig, "save"), 1) == ActionResult::finished);
  CHECK(rig.clock.now() - began > 500ms);
  CHECK(rig.read(0x0193) == 0);
  rig.tool->power_cycle(1, rig.clock.now());
  CHECK(rig.read(0x0485) == 777);
}

TEST_CASE("blv device: what cannot be done now is refused with the reason") {
  BlvRig rig;
  auto device = rig.open();
  rig.write(0x007D, 0x2A);
  const auto refused = device.perform(action(rig, "configure"), 1);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().device_code == 0x8D);
  CHECK(refused.error().name == "configure");
}

TEST_CASE("blv device: a group needs both words") {
  BlvRig rig;
  auto device = rig.open();
  CHECK(device.perform(action(rig, "group"), 5) == ActionResult::confirmed);
  CHECK(rig.read(0x0031) == 5);
  CHECK(device.perform(action(rig, "group"), -1) == ActionResult::confirmed);
  CHECK(rig.read(0x0030) == 0xFFFF);
  CHECK(rig.read(0x0031) == 0xFFFF);
}

TEST_CASE("blv device: names of bits are those of the input mode that is set") {
  BlvRig rig;
  auto device = rig.open();
  const auto word = rig.profile.find("command.driver-input").value();
  rig.write(0x007D, 0x2A);
  CHECK(device.read_each({word}, device::Limits::skip)->front().value->label == "M1 FWD STOP-MODE");
  rig.write(0x007D, 0);
  rig.configure(0x1040, 1);
  rig.write(0x007D, 0x3A);
  CHECK(device.read_each({word}, device::Limits::skip)->front().value->label ==
        "M1 START/STOP RUN/BRAKE FWD/REV");
}

TEST_CASE("blv device: a broadcast reaches all, and an edge of it too") {
  BlvRig rig({.units = {1, 2}});
  rig.endpoint.unit = modbus::UnitId{0};
  auto device = rig.open();
  const auto speed = rig.profile.find("operation.2.speed").value();
  REQUIRE(device.broadcast(speed, catalogue::Value{Decimal(1500), {}}));
  CHECK(rig.read(0x0485, 1) == 1500);
  CHECK(rig.read(0x0485, 2) == 1500);
  rig.write(0x1041, 1, 2);
  REQUIRE(device.broadcast(action(rig, "configure"), 1));
  CHECK(rig.read(0x018D, 2) == 0);
  rig.write(0x007D, 0x1A, 2);
  CHECK(rig.moves(2));
}
