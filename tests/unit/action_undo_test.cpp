#include "spindle/device/action_undo.hpp"

#include <doctest/doctest.h>

#include <chrono>

#include "support/rig.hpp"

namespace {

using namespace spindle;
using namespace std::chrono_literals;
using device::Device;
using device::RollbackResult;
using device::UndoReport;
using test::BmRig;
using test::Fate;
using test::next_meet;

constexpr std::uint16_t turn = 4005;

/// A tool that was set to loosening.
struct Bench {
  Bench() : device(rig.open()) {
    action.name = "direction";
    action.address = {turn};
    action.maximum = 1;
    action.confirm = "status.direction";
    REQUIRE(device.send(action, 1));
  }
  UndoReport undo() {
    return device::undo(
        {action, 1, 0}, device, [this](Duration) { return rig.connect_uninterruptibly(); },
        rig.uninterruptible);
  }
  [[nodiscard]] std::uint16_t direction() { return rig.read_input(3309); }

  BmRig rig = BmRig();
  Device device;
  catalogue::Action action = {};
};

TEST_CASE("an action is undone, and the tool shows it") {
  Bench bench;
  REQUIRE(bench.direction() == 1);
  SUBCASE("at once") {}
  SUBCASE("behind an interrupt") { bench.rig.interrupt.raise(2); }
  SUBCASE("when an answer is lost") { bench.rig.wire.fate = next_meet(Fate::is_lost, 1); }
  SUBCASE("when it is done and its answer is lost") {
    bench.rig.wire.fate = [seen = 0](const modbus::Pdu&) mutable {
      return ++seen == 2 ? Fate::has_no_answer : Fate::passes;
    };
  }
  SUBCASE("when the connection ends") { bench.rig.wire.fate = next_meet(Fate::closes_unheard, 1); }
  SUBCASE("when nothing gets through for a while") {
    bench.rig.wire.fate = next_meet(Fate::is_lost, 5);
  }
  const UndoReport report = bench.undo();
  CHECK(report.result == RollbackResult::done);
  CHECK(report.found == 1);
  CHECK(bench.direction() == 0);
  CHECK(bench.rig.writes_of(turn, 0) >= 1);
}

TEST_CASE("what cannot be undone is said") {
  Bench bench;
  SUBCASE("only echoed") {
    bench.rig.wire.fate = [](const modbus::Pdu& request) {
      return request.function == 6 ? Fate::is_only_echoed : Fate::passes;
    };
    CHECK(bench.undo().result == RollbackResult::refused);
  }
  SUBCASE("refused") {
    bench.rig.wire.fate = [](const modbus::Pdu& request) {
      return request.function == 6 ? Fate::is_refused : Fate::passes;
    };
    CHECK(bench.undo().result == RollbackResult::refused);
  }
  SUBCASE("gone") {
    bench.rig.wire.unreachable_until = TimePoint::max();
    bench.rig.wire.fate = [](const modbus::Pdu&) { return Fate::closes_unheard; };
    const TimePoint began = bench.rig.clock.now();
    CHECK(bench.undo().result == RollbackResult::unknown);
    CHECK(bench.rig.clock.now() - began < 12s);
  }
  CHECK_FALSE(bench.undo().trouble.empty());
}

TEST_CASE("what another hand changed meanwhile is left alone") {
  Bench bench;
  bench.rig.write(turn, 0);
  const UndoReport kept = bench.undo();
  CHECK(kept.result == RollbackResult::kept);
  CHECK(bench.rig.writes_of(turn, 0) == 0);
  const UndoReport other = device::undo(
      {bench.action, 2, 1}, bench.device,
      [&](Duration) { return bench.rig.connect_uninterruptibly(); }, bench.rig.uninterruptible);
  CHECK(other.result == RollbackResult::refused);
  CHECK(other.trouble == "it was changed to 0 meanwhile");
  CHECK(bench.rig.writes_of(turn, 1) == 1);
}

}  // namespace
