#include "spindle/device/run_guard.hpp"

#include <doctest/doctest.h>

#include <chrono>
#include <stdexcept>
#include <string>
#include <vector>

#include "support/guarded_tool.hpp"

namespace {

using namespace spindle;
using namespace std::chrono_literals;
using device::Device;
using device::RunGuard;
using device::StopReport;
using device::StopResult;
using test::Fate;
using test::fate_of;
using test::GuardedTool;

/// A tool, a connection to it and a guard, as a command has them.
struct Bench {
  explicit Bench(GuardedTool& guarded) : tool(guarded), device(guarded.open()) {}

  RunGuard::Reopen reopen() {
    return [this](Duration patience) {
      patiences.push_back(patience);
      return tool.open(tool.calm, tool.never);
    };
  }
  void wait(Duration duration) { tool.clock.advance(duration); }

  GuardedTool& tool;
  Device device;
  catalogue::Action start = tool.start_action();
  std::vector<Duration> patiences = {};
  RunGuard guard = RunGuard(device, start, reopen(), tool.calm);
};

TEST_CASE("a started tool is stopped, and the tool says so") {
  GuardedTool tool;
  Bench bench(tool);
  REQUIRE(bench.guard.start());
  bench.wait(300ms);
  REQUIRE(tool.runs());
  const StopReport report = bench.guard.stop();
  CHECK(report.result == StopResult::confirmed);
  CHECK(report.attempts == 1);
  CHECK(report.tried < 10ms);
  CHECK_FALSE(tool.runs());
  CHECK(tool.writes == std::vector<GuardedTool::Write>{{4003, 1}, {4003, 0}});
}

TEST_CASE("a second stop sends nothing and reports the same") {
  GuardedTool tool;
  Bench bench(tool);
  REQUIRE(bench.guard.start());
  const StopReport first = bench.guard.stop();
  const StopReport second = bench.guard.stop();
  CHECK(second.result == first.result);
  CHECK(second.attempts == first.attempts);
  CHECK(tool.stops() == 1);
}

TEST_CASE("the destructor stops what nobody stopped") {
  GuardedTool tool;
  SUBCASE("at the end of a scope") {
    { CHECK(Bench(tool).guard.start()); }
  }
  SUBCASE("when an exception passes") {
    const auto fall = [&] {
      Bench bench(tool);
      CHECK(bench.guard.start());
      throw std::runtime_error("a bug");
    };
    CHECK_THROWS_AS(fall(), std::runtime_error);
  }
  SUBCASE("after a start without an answer") {
    tool.fate = fate_of(1, Fate::has_no_answer);
    { CHECK_FALSE(Bench(tool).guard.start()); }
  }
  CHECK(tool.starts() == 1);
  CHECK(tool.stops() == 1);
  CHECK_FALSE(tool.runs());
}

TEST_CASE("a guard that never started stops nothing by itself") {
  GuardedTool tool;
  { const Bench bench(tool); }
  CHECK(tool.writes.empty());
}

struct Trouble {
  const char* what;
  std::uint16_t value;  ///< of the write that it befalls
  Fate fate;
  unsigned times;
  bool acknowledged;          ///< the start
  std::uint32_t connections;  ///< in the end
};

constexpr Trouble troubles[] = {
    {"the start is lost", 1, Fate::is_lost, 1, false, 1},
    {"the start has no answer", 1, Fate::has_no_answer, 1, false, 1},
    {"the start is refused", 1, Fate::is_refused, 1, false, 1},
    {"the start is echoed and ignored", 1, Fate::is_only_echoed, 1, true, 1},
    {"closed before the tool heard the start", 1, Fate::closes_unheard, 1, false, 2},
    {"closed before the echo of the start", 1, Fate::closes_heard, 1, false, 2},
    {"the first stop is lost", 0, Fate::is_lost, 1, true, 1},
    {"two stops are lost", 0, Fate::is_lost, 2, true, 2},
    {"five stops are lost", 0, Fate::is_lost, 5, true, 3},
    {"the stop has no answer", 0, Fate::has_no_answer, 1, true, 1},
    {"the stop is refused twice", 0, Fate::is_refused, 2, true, 1},
    {"the stop is echoed and ignored", 0, Fate::is_only_echoed, 1, true, 1},
    {"closed before the tool heard the stop", 0, Fate::closes_unheard, 1, true, 2},
    {"closed before the echo of the stop", 0, Fate::closes_heard, 1, true, 2},
};

TEST_CASE("one start, and a stop that works, whatever becomes of either") {
  for (const Trouble& trouble : troubles) {
    CAPTURE(trouble.what);
    GuardedTool tool;
    Bench bench(tool);
    tool.fate = fate_of(trouble.value, trouble.fate, trouble.times);
    CHECK(bench.guard.start().has_value() == trouble.acknowledged);
    const StopReport report = bench.guard.stop();
    CHECK(report.result == StopResult::confirmed);
    CHECK(report.tried <= 10s);
    CHECK_FALSE(tool.runs());
    CHECK(tool.starts() == 1);
    CHECK(tool.stops() >= 1);
    CHECK(tool.writes.back() == GuardedTool::Write(4003, 0));
    CHECK(tool.connections == trouble.connections);
    // A tool may serve one client only: the old connection ends before the new one begins.
    CHECK(tool.most_open_connections == 1);
    // The caller goes on with the connection that works.
    CHECK(bench.device.event_number().has_value());
  }
}

TEST_CASE("an interrupt does not keep the stop from the tool") {
  GuardedTool tool;
  Bench bench(tool);
  SUBCASE("while it runs") {
    REQUIRE(bench.guard.start());
    bench.wait(100ms);
    tool.interrupt.raise(2);
    CHECK(tool.runs());
  }
  SUBCASE("before the start: it is not sent any more") {
    tool.interrupt.raise(15);
    const auto started = bench.guard.start();
    REQUIRE_FALSE(started);
    CHECK(started.error().code == Errc::terminated);
    CHECK(tool.starts() == 0);
  }
  SUBCASE("while the echo of the start is awaited") {
    tool.fate = fate_of(1, Fate::has_no_answer);
    tool.clock.at(tool.clock.now() + 50ms, [&] { tool.interrupt.raise(2); });
    const auto started = bench.guard.start();
    REQUIRE_FALSE(started);
    CHECK(started.error().code == Errc::interrupted);
    CHECK(tool.runs());
  }
  SUBCASE("and the link is gone, too") {
    REQUIRE(bench.guard.start());
    tool.interrupt.raise(2);
    tool.fate = fate_of(0, Fate::closes_unheard, 2);
  }
  CHECK(bench.guard.stop().result == StopResult::confirmed);
  CHECK_FALSE(tool.runs());
  CHECK(tool.starts() <= 1);
  CHECK(tool.stops() >= 1);
}

TEST_CASE("a start that was still under way on the old connection is stopped, too") {
  GuardedTool tool;
  Bench bench(tool);
  tool.fate = fate_of(1, Fate::closes_unheard);
  tool.clock.at(tool.clock.now() + 400ms, [&] { tool.write_past(4003, 1); });
  CHECK_FALSE(bench.guard.start());
  const StopReport report = bench.guard.stop();
  CHECK(report.result == StopResult::confirmed);
  CHECK(report.tried >= 1s);
  bench.wait(400ms);
  CHECK_FALSE(tool.runs());
}

TEST_CASE("a tool that never stops is tried for ten seconds and said so") {
  GuardedTool tool;
  Bench bench(tool);
  std::string trouble;
  SUBCASE("it echoes, and runs on") {
    tool.fate = [](const modbus::Pdu& request) {
      return request == modbus::write_request({4003}, 0) ? Fate::is_only_echoed : Fate::passes;
    };
    trouble = "the tool still says that it runs";
  }
  SUBCASE("it refuses") {
    tool.fate = fate_of(0, Fate::is_refused);
    trouble = "the tool refused 'write register 4003'";
  }
  SUBCASE("it says nothing") {
    tool.fate = fate_of(0, Fate::is_lost);
    trouble = "no answer";
  }
  SUBCASE("nobody can reach it any more") {
    tool.fate = [&tool](const modbus::Pdu& request) {
      tool.reachable = false;
      return request == modbus::write_request({4003}, 0) ? Fate::closes_unheard : Fate::passes;
    };
    trouble = "connection refused";
  }
  // A preset that takes long.
  tool.write_past(11, 9000);
  tool.write_past(13, 9000);
  REQUIRE(bench.guard.start());
  const StopReport report = bench.guard.stop();
  CHECK(report.result == StopResult::unconfirmed);
  CHECK(report.tried >= 9s);
  CHECK(report.tried <= 12s);
  CHECK(report.attempts >= 5);
  CAPTURE(report.trouble);
  CHECK(report.trouble.find(trouble) != std::string::npos);
  CHECK(tool.starts() == 1);
  for (const Duration patience : bench.patiences) CHECK(patience <= 10s);
  // Whoever goes on with the device gets errors, and no crash.
  static_cast<void>(bench.device.event_number());
}

TEST_CASE("a tool that answers slowly is believed") {
  GuardedTool tool({}, {{.kind = sim::FaultKind::latency, .duration = 800ms}});
  Bench bench(tool);
  REQUIRE(bench.guard.start());
  const StopReport report = bench.guard.stop();
  CHECK(report.result == StopResult::confirmed);
  CHECK(tool.connections == 1);
  CHECK(tool.stops() == 2);
}

TEST_CASE("however patient the user is, a stop without an answer is soon sent again") {
  GuardedTool tool;
  tool.answer_timeout = 60s;
  tool.retries = 100;
  Bench bench(tool);
  REQUIRE(bench.guard.start());
  SUBCASE("the stop has no answer") { tool.fate = fate_of(0, Fate::is_lost); }
  SUBCASE("its proof has none") {
    tool.fate = [](const modbus::Pdu& request) {
      return request.function == 4 ? Fate::is_lost : Fate::passes;
    };
  }
  const StopReport report = bench.guard.stop();
  CHECK(report.result == StopResult::unconfirmed);
  CHECK(report.tried <= 13s);
  CHECK(tool.stops() >= 5);
}

TEST_CASE("what another program started is pursued over lost answers and connections") {
  GuardedTool tool;
  const catalogue::Action start = tool.start_action();
  tool.write_past(4003, 1);
  tool.clock.advance(100ms);
  REQUIRE(tool.runs());
  unsigned opened = 0;
  const auto open = [&](Duration patience) -> Result<Device> {
    CHECK(patience <= 10s);
    tool.reachable = ++opened > 3;
    return tool.open(tool.calm, tool.never);
  };
  tool.fate = fate_of(0, Fate::closes_unheard, 2);
  RunGuard guard(device::motion_of(start), open, tool.calm, 0s);
  const StopReport report = guard.stop();
  CHECK(report.result == StopResult::confirmed);
  CHECK(report.attempts == 6);
  CHECK(opened == 6);
  CHECK_FALSE(tool.runs());
  CHECK(tool.starts() == 0);
}

TEST_CASE("a pursued stop goes on for ten seconds, and no longer where it is hopeless") {
  GuardedTool tool;
  tool.reachable = false;
  const catalogue::Action start = tool.start_action();
  device::GuardedMotion motion = device::motion_of(start);
  const auto open = [&](Duration) { return tool.open(tool.calm, tool.never); };
  const TimePoint began = tool.clock.now();
  SUBCASE("a tool that can not be reached") {
    RunGuard guard(motion, open, tool.calm, 0s);
    CHECK(guard.stop().result == StopResult::unconfirmed);
    CHECK(tool.clock.now() - began > 9s);
    CHECK(tool.clock.now() - began < 11s);
  }
  SUBCASE("an error that stays") {
    motion.hopeless = [](const Error& error) { return error.code == Errc::connection_refused; };
    RunGuard guard(motion, open, tool.calm, 0s);
    const StopReport report = guard.stop();
    CHECK(report.result == StopResult::unconfirmed);
    CHECK(report.attempts == 1);
  }
}

TEST_CASE("stop_and_confirm without a guard: once, and proven") {
  GuardedTool tool;
  Device device = tool.open();
  const catalogue::Action start = tool.start_action();
  SUBCASE("a running tool") {
    tool.write_past(4003, 1);
    CHECK(device::stop_and_confirm(device, start, tool.clock) == StopResult::confirmed);
    CHECK_FALSE(tool.runs());
  }
  SUBCASE("a tool at rest") {
    CHECK(device::stop_and_confirm(device, start, tool.clock) == StopResult::confirmed);
  }
  SUBCASE("a product whose running state can not be read") {
    catalogue::Action blind = start;
    blind.confirm = {};
    CHECK(device::stop_and_confirm(device, blind, tool.clock) == StopResult::sent);
  }
  SUBCASE("a tool that runs on") {
    tool.write_past(4003, 1);
    tool.fate = fate_of(0, Fate::is_only_echoed);
    CHECK(device::stop_and_confirm(device, start, tool.clock) == StopResult::unconfirmed);
  }
  CHECK(tool.stops() == 1);
}

}  // namespace
