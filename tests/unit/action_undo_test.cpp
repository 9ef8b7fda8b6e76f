#include "spindle/device/action_undo.hpp"

#include <doctest/doctest.h>

#include <chrono>

#include "support/guarded_tool.hpp"

namespace {

using namespace spindle;
using namespace std::chrono_literals;
using device::Device;
using device::PutBack;
using device::UndoReport;
using test::Fate;
using test::GuardedTool;

constexpr std::uint16_t turn = 4005;

/// A tool that was set to loosening.
struct Bench {
  Bench() : device(tool.open()) {
    action.name = "direction";
    action.address = {turn};
    action.maximum = 1;
    action.confirm = "status.direction";
    REQUIRE(device.send(action, 1));
  }
  UndoReport undo() {
    return device::undo(
        {action, 1, 0}, device, [this](Duration) { return tool.open(tool.calm, tool.never); },
        tool.calm);
  }
  [[nodiscard]] std::uint16_t direction() {
    const auto answer = tool.bm->answer(
        {99}, {}, modbus::read_request(modbus::RegisterTable::input, {3309}, 1), tool.clock.now());
    return modbus::registers_of(answer.value()).front();
  }

  GuardedTool tool = GuardedTool();
  Device device;
  catalogue::Action action = {};
};

/// The fate of the next requests, so many of them; the others pass.
std::function<Fate(const modbus::Pdu&)> next(unsigned times, Fate fate) {
  return [=, left = times](const modbus::Pdu&) mutable {
    return left > 0 && left-- > 0 ? fate : Fate::passes;
  };
}

TEST_CASE("an action is undone, and the tool shows it") {
  Bench bench;
  REQUIRE(bench.direction() == 1);
  SUBCASE("at once") {}
  SUBCASE("behind an interrupt") { bench.tool.interrupt.raise(2); }
  SUBCASE("when an answer is lost") { bench.tool.fate = next(1, Fate::is_lost); }
  SUBCASE("when it is done and its answer is lost") {
    bench.tool.fate = [seen = 0](const modbus::Pdu&) mutable {
      return ++seen == 2 ? Fate::has_no_answer : Fate::passes;
    };
  }
  SUBCASE("when the connection ends") { bench.tool.fate = next(1, Fate::closes_unheard); }
  SUBCASE("when nothing gets through for a while") { bench.tool.fate = next(5, Fate::is_lost); }
  const UndoReport report = bench.undo();
  CHECK(report.result == PutBack::done);
  CHECK(report.found == 1);
  CHECK(bench.direction() == 0);
  CHECK(bench.tool.writes_of(turn, 0) >= 1);
}

TEST_CASE("what can not be undone is said") {
  Bench bench;
  SUBCASE("only echoed") {
    bench.tool.fate = [](const modbus::Pdu& request) {
      return request.function == 6 ? Fate::is_only_echoed : Fate::passes;
    };
    CHECK(bench.undo().result == PutBack::refused);
  }
  SUBCASE("refused") {
    bench.tool.fate = [](const modbus::Pdu& request) {
      return request.function == 6 ? Fate::is_refused : Fate::passes;
    };
    CHECK(bench.undo().result == PutBack::refused);
  }
  SUBCASE("gone") {
    bench.tool.reachable = false;
    bench.tool.fate = [](const modbus::Pdu&) { return Fate::closes_unheard; };
    const TimePoint began = bench.tool.clock.now();
    CHECK(bench.undo().result == PutBack::unknown);
    CHECK(bench.tool.clock.now() - began < 12s);
  }
  CHECK_FALSE(bench.undo().trouble.empty());
}

TEST_CASE("what another hand changed meanwhile is left alone") {
  Bench bench;
  bench.tool.write_past(turn, 0);
  const UndoReport kept = bench.undo();
  CHECK(kept.result == PutBack::kept);
  CHECK(bench.tool.writes_of(turn, 0) == 0);
  const UndoReport other = device::undo(
      {bench.action, 2, 1}, bench.device,
      [&](Duration) { return bench.tool.open(bench.tool.calm, bench.tool.never); },
      bench.tool.calm);
  CHECK(other.result == PutBack::refused);
  CHECK(other.trouble == "it was changed to 0 meanwhile");
  CHECK(bench.tool.writes_of(turn, 1) == 1);
}

}  // namespace
