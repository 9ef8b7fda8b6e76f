#include "spindle/device/run_guard.hpp"

#include <doctest/doctest.h>

#include <chrono>
#include <stdexcept>
#include <string>
#include <vector>

#include "support/rig.hpp"

namespace {

using namespace spindle;
using namespace std::chrono_literals;
using device::Device;
using device::RunGuard;
using device::StopReport;
using device::StopResult;
using test::BmRig;
using test::Fate;

/// The fate of writes of one value to the start register, so often; all else passes.
auto fate_of(std::uint16_t value, Fate fate, unsigned times = 1'000'000) {
  return test::next_meet(fate, times, [value](const modbus::Pdu& request) {
    return request == modbus::write_request({BmRig::start_register}, value);
  });
}

/// A tool, a connection to it and a guard, as a command has them.
struct Bench {
  explicit Bench(BmRig& of) : rig(of), device(of.open()) {}

  RunGuard::Reopen reopen() {
    return [this](Duration patience) {
      patiences.push_back(patience);
      return rig.connect_uninterruptibly();
    };
  }
  void wait(Duration duration) { rig.clock.advance(duration); }

  BmRig& rig;
  Device device;
  catalogue::Action start = rig.start_action();
  std::vector<Duration> patiences = {};
  RunGuard guard = RunGuard(device, start, reopen(), rig.uninterruptible);
};

TEST_CASE("a started tool is stopped, and the tool says so") {
  BmRig rig;
  Bench bench(rig);
  REQUIRE(bench.guard.start());
  bench.wait(300ms);
  REQUIRE(rig.runs());
  const StopReport report = bench.guard.stop();
  CHECK(report.result == StopResult::confirmed);
  CHECK(report.attempts == 1);
  CHECK(report.tried < 10ms);
  CHECK_FALSE(rig.runs());
  CHECK(rig.wire.writes() == std::vector<test::Wire::Write>{{4003, 1}, {4003, 0}});
}

TEST_CASE("a second stop sends nothing and reports the same") {
  BmRig rig;
  Bench bench(rig);
  REQUIRE(bench.guard.start());
  const StopReport first = bench.guard.stop();
  const StopReport second = bench.guard.stop();
  CHECK(second.result == first.result);
  CHECK(second.attempts == first.attempts);
  CHECK(rig.stops() == 1);
}

TEST_CASE("the destructor stops what was not stopped") {
  BmRig rig;
  SUBCASE("at the end of a scope") {
    { CHECK(Bench(rig).guard.start()); }
  }
  SUBCASE("when an exception passes") {
    const auto fall = [&] {
      Bench bench(rig);
      CHECK(bench.guard.start());
      throw std::runtime_error("a bug");
    };
    CHECK_THROWS_AS(fall(), std::runtime_error);
  }
  SUBCASE("after a start without an answer") {
    rig.wire.fate = fate_of(1, Fate::has_no_answer);
    { CHECK_FALSE(Bench(rig).guard.start()); }
  }
  CHECK(rig.starts() == 1);
  CHECK(rig.stops() == 1);
  CHECK_FALSE(rig.runs());
}

TEST_CASE("a guard that never started stops nothing by itself") {
  BmRig rig;
  { const Bench bench(rig); }
  CHECK(rig.wire.writes().empty());
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
    BmRig rig;
    Bench bench(rig);
    rig.wire.fate = fate_of(trouble.value, trouble.fate, trouble.times);
    CHECK(bench.guard.start().has_value() == trouble.acknowledged);
    const StopReport report = bench.guard.stop();
    CHECK(report.result == StopResult::confirmed);
    CHECK(report.tried <= 10s);
    CHECK_FALSE(rig.runs());
    CHECK(rig.starts() == 1);
    CHECK(rig.stops() >= 1);
    CHECK(rig.wire.writes().back() == test::Wire::Write(4003, 0));
    CHECK(rig.wire.connections == trouble.connections);
    // A tool may serve one client only: the old connection ends before the new one begins.
    CHECK(rig.wire.most_open_connections == 1);
    // The caller goes on with the connection that works.
    CHECK(bench.device.event_number().has_value());
  }
}

TEST_CASE("an interrupt does not keep the stop from the tool") {
  BmRig rig;
  Bench bench(rig);
  SUBCASE("while it runs") {
    REQUIRE(bench.guard.start());
    bench.wait(100ms);
    rig.interrupt.raise(2);
    CHECK(rig.runs());
  }
  SUBCASE("before the start: it is not sent any more") {
    rig.interrupt.raise(15);
    const auto started = bench.guard.start();
    REQUIRE_FALSE(started);
    CHECK(started.error().code == Errc::terminated);
    CHECK(rig.starts() == 0);
  }
  SUBCASE("while the echo of the start is awaited") {
    rig.wire.fate = fate_of(1, Fate::has_no_answer);
    rig.clock.at(rig.clock.now() + 50ms, [&] { rig.interrupt.raise(2); });
    const auto started = bench.guard.start();
    REQUIRE_FALSE(started);
    CHECK(started.error().code == Errc::interrupted);
    CHECK(rig.runs());
  }
  SUBCASE("and the link is gone, too") {
    REQUIRE(bench.guard.start());
    rig.interrupt.raise(2);
    rig.wire.fate = fate_of(0, Fate::closes_unheard, 2);
  }
  CHECK(bench.guard.stop().result == StopResult::confirmed);
  CHECK_FALSE(rig.runs());
  CHECK(rig.starts() <= 1);
  CHECK(rig.stops() >= 1);
}

TEST_CASE("a start that was still under way on the old connection is stopped, too") {
  BmRig rig;
  Bench bench(rig);
  rig.wire.fate = fate_of(1, Fate::closes_unheard);
  rig.clock.at(rig.clock.now() + 400ms, [&] { rig.write(4003, 1); });
  CHECK_FALSE(bench.guard.start());
  const StopReport report = bench.guard.stop();
  CHECK(report.result == StopResult::confirmed);
  CHECK(report.tried >= 1s);
  bench.wait(400ms);
  CHECK_FALSE(rig.runs());
}

TEST_CASE("a tool that never stops is tried for ten seconds and said so") {
  BmRig rig;
  Bench bench(rig);
  std::string trouble;
  SUBCASE("it echoes, and runs on") {
    rig.wire.fate = [](const modbus::Pdu& request) {
      return request == modbus::write_request({4003}, 0) ? Fate::is_only_echoed : Fate::passes;
    };
    trouble = "the tool still says that it runs";
  }
  SUBCASE("it refuses") {
    rig.wire.fate = fate_of(0, Fate::is_refused);
    trouble = "the tool refused 'write register 4003'";
  }
  SUBCASE("it says nothing") {
    rig.wire.fate = fate_of(0, Fate::is_lost);
    trouble = "no answer";
  }
  SUBCASE("it cannot be reached any more") {
    rig.wire.fate = [&rig](const modbus::Pdu& request) {
      rig.wire.unreachable_until = TimePoint::max();
      return request == modbus::write_request({4003}, 0) ? Fate::closes_unheard : Fate::passes;
    };
    trouble = "connection refused";
  }
  // A preset that takes long.
  rig.write(11, 9000);
  rig.write(13, 9000);
  REQUIRE(bench.guard.start());
  const StopReport report = bench.guard.stop();
  CHECK(report.result == StopResult::unconfirmed);
  CHECK(report.tried >= 9s);
  CHECK(report.tried <= 12s);
  CHECK(report.attempts >= 5);
  CAPTURE(report.trouble);
  CHECK(report.trouble.find(trouble) != std::string::npos);
  CHECK(rig.starts() == 1);
  for (const Duration patience : bench.patiences) CHECK(patience <= 10s);
  // A caller that goes on with the device gets errors, and no crash.
  static_cast<void>(bench.device.event_number());
}

TEST_CASE("a tool that answers slowly is believed") {
  BmRig rig;
  rig.faults = {{.kind = sim::FaultKind::latency, .duration = 800ms}};
  Bench bench(rig);
  REQUIRE(bench.guard.start());
  const StopReport report = bench.guard.stop();
  CHECK(report.result == StopResult::confirmed);
  CHECK(rig.wire.connections == 1);
  CHECK(rig.stops() == 2);
}

TEST_CASE("however patient the user is, a stop without an answer is soon sent again") {
  BmRig rig;
  rig.options.answer_timeout = 60s;
  rig.options.retries = 100;
  Bench bench(rig);
  REQUIRE(bench.guard.start());
  SUBCASE("the stop has no answer") { rig.wire.fate = fate_of(0, Fate::is_lost); }
  SUBCASE("its proof has none") {
    rig.wire.fate = [](const modbus::Pdu& request) {
      return request.function == 4 ? Fate::is_lost : Fate::passes;
    };
  }
  const StopReport report = bench.guard.stop();
  CHECK(report.result == StopResult::unconfirmed);
  CHECK(report.tried <= 13s);
  CHECK(rig.stops() >= 5);
}

TEST_CASE("what another program started is pursued over lost answers and connections") {
  BmRig rig;
  const catalogue::Action start = rig.start_action();
  rig.write(4003, 1);
  rig.clock.advance(100ms);
  REQUIRE(rig.runs());
  unsigned opened = 0;
  const auto open = [&](Duration patience) -> Result<Device> {
    CHECK(patience <= 10s);
    rig.wire.unreachable_until = ++opened > 3 ? TimePoint::min() : TimePoint::max();
    return rig.connect_uninterruptibly();
  };
  rig.wire.fate = fate_of(0, Fate::closes_unheard, 2);
  RunGuard guard(device::motion_of(start), open, rig.uninterruptible, 0s);
  const StopReport report = guard.stop();
  CHECK(report.result == StopResult::confirmed);
  CHECK(report.attempts == 6);
  CHECK(opened == 6);
  CHECK_FALSE(rig.runs());
  CHECK(rig.starts() == 0);
}

TEST_CASE("a pursued stop goes on for ten seconds, and no longer where it is hopeless") {
  BmRig rig;
  rig.wire.unreachable_until = TimePoint::max();
  const catalogue::Action start = rig.start_action();
  device::GuardedMotion motion = device::motion_of(start);
  const auto open = [&](Duration) { return rig.connect_uninterruptibly(); };
  const TimePoint began = rig.clock.now();
  SUBCASE("a tool that cannot be reached") {
    RunGuard guard(motion, open, rig.uninterruptible, 0s);
    CHECK(guard.stop().result == StopResult::unconfirmed);
    CHECK(rig.clock.now() - began > 9s);
    CHECK(rig.clock.now() - began < 11s);
  }
  SUBCASE("an error that stays") {
    motion.hopeless = [](const Error& error) { return error.code == Errc::connection_refused; };
    RunGuard guard(motion, open, rig.uninterruptible, 0s);
    const StopReport report = guard.stop();
    CHECK(report.result == StopResult::unconfirmed);
    CHECK(report.attempts == 1);
  }
}

TEST_CASE("stop_and_confirm without a guard: once, and proven") {
  BmRig rig;
  Device device = rig.open();
  const catalogue::Action start = rig.start_action();
  SUBCASE("a running tool") {
    rig.write(4003, 1);
    CHECK(device::stop_and_confirm(device, start, rig.clock) == StopResult::confirmed);
    CHECK_FALSE(rig.runs());
  }
  SUBCASE("a tool at rest") {
    CHECK(device::stop_and_confirm(device, start, rig.clock) == StopResult::confirmed);
  }
  SUBCASE("a product whose running state cannot be read") {
    catalogue::Action blind = start;
    blind.confirm = {};
    CHECK(device::stop_and_confirm(device, blind, rig.clock) == StopResult::sent);
  }
  SUBCASE("a tool that runs on") {
    rig.write(4003, 1);
    rig.wire.fate = fate_of(0, Fate::is_only_echoed);
    CHECK(device::stop_and_confirm(device, start, rig.clock) == StopResult::unconfirmed);
  }
  CHECK(rig.stops() == 1);
}

}  // namespace
