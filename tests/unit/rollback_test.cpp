#include "spindle/device/rollback.hpp"

#include <doctest/doctest.h>

#include <chrono>
#include <string>
#include <vector>

#include "spindle/modbus/pdu.hpp"
#include "support/rig.hpp"

namespace {

using namespace spindle;
using namespace std::chrono_literals;
using device::Device;
using device::JournalEntry;
using device::PutBackReport;
using device::Rollback;
using device::RollbackResult;
using test::BmRig;
using test::Fate;

/// A tool on which p301 and p302 were written, and the third write went wrong.
struct Bench {
  explicit Bench(BmRig& of) : rig(of), device(of.open()) {
    for (std::uint16_t number = 301; number <= 303; ++number) {
      writes.push_back({rig.profile.find("p" + std::to_string(number)).value(),
                        {Decimal(0), {}},
                        {Decimal(50), {}}});
    }
    rig.write(301, 50);
    rig.write(302, 50);
  }

  std::vector<PutBackReport> run() { return rollback.run(writes); }
  std::vector<RollbackResult> results() {
    std::vector<RollbackResult> all;
    for (const PutBackReport& report : run()) all.push_back(report.result);
    return all;
  }
  std::vector<std::uint16_t> values() {
    return rig.registers(modbus::RegisterTable::holding, 301, 3);
  }

  BmRig& rig;
  Device device;
  std::vector<JournalEntry> writes = {};
  unsigned reopened = 0;
  Rollback rollback = Rollback(
      device,
      [this](Duration) {
        ++reopened;
        return rig.connect_uninterruptibly();
      },
      rig.uninterruptible);
};

const std::vector<std::uint16_t> zeros = {0, 0, 0};
const std::vector<RollbackResult> all_put_back = {RollbackResult::kept, RollbackResult::done,
                                                  RollbackResult::done};

/// Writes of one register meet this fate, so often.
auto fate_of_writes(std::uint16_t address, Fate fate, unsigned times = 1'000'000) {
  return test::next_meet(fate, times, [address](const modbus::Pdu& request) {
    const auto parsed = modbus::parse_request(request);
    const auto* write = parsed ? std::get_if<modbus::WriteSingleRequest>(&*parsed) : nullptr;
    return write != nullptr && write->address.value == address;
  });
}

TEST_CASE("what was written is put back, the last first, and what was not is left alone") {
  BmRig rig;
  Bench bench(rig);
  const auto reports = bench.run();
  REQUIRE(reports.size() == 3);
  CHECK(reports[0].write.parameter.name == "p303");
  CHECK(reports[0].result == RollbackResult::kept);
  CHECK(reports[1].found->to_string() == "50");
  CHECK(reports[1].now->to_string() == "0");
  CHECK(bench.values() == zeros);
  CHECK(rig.wire.writes() == std::vector<test::Wire::Write>{{302, 0}, {301, 0}});
  CHECK(bench.reopened == 0);
}

TEST_CASE("an interrupt does not end it") {
  BmRig rig;
  Bench bench(rig);
  rig.interrupt.raise(2);
  CHECK(bench.results() == all_put_back);
  CHECK(bench.values() == zeros);
}

TEST_CASE("a lost link is opened anew") {
  for (const Fate fate :
       {Fate::closes_heard, Fate::closes_unheard, Fate::has_no_answer, Fate::is_lost}) {
    CAPTURE(static_cast<int>(fate));
    BmRig rig;
    Bench bench(rig);
    rig.wire.fate = fate_of_writes(302, fate, 3);
    CHECK(bench.results() == all_put_back);
    CHECK(bench.values() == zeros);
    CHECK(rig.wire.most_open_connections == 1);
  }
}

TEST_CASE("a tool that refuses its old value is told with what it holds") {
  BmRig rig;
  Bench bench(rig);
  rig.wire.fate = fate_of_writes(302, Fate::is_refused);
  const auto reports = bench.run();
  CHECK(reports[1].result == RollbackResult::refused);
  CHECK(reports[1].now->to_string() == "50");
  CHECK(reports[1].trouble.find("exception 02") != std::string::npos);
  CHECK(reports[2].result == RollbackResult::done);
  CHECK(bench.values() == std::vector<std::uint16_t>{0, 50, 0});
}

TEST_CASE("a tool that only echoes its old value is told as well") {
  BmRig rig;
  Bench bench(rig);
  rig.wire.fate = fate_of_writes(302, Fate::is_only_echoed);
  const auto reports = bench.run();
  CHECK(reports[1].result == RollbackResult::refused);
  CHECK(reports[1].now->to_string() == "50");
}

TEST_CASE("a tool that is gone is given up after about ten seconds, and nothing is claimed") {
  BmRig rig;
  Bench bench(rig);
  rig.wire.unreachable_until = TimePoint::max();
  rig.wire.fate = [](const modbus::Pdu&) { return Fate::closes_unheard; };
  const TimePoint began = rig.clock.now();
  const auto reports = bench.run();
  REQUIRE(reports.size() == 3);
  for (const PutBackReport& report : reports) {
    CHECK(report.result == RollbackResult::unknown);
    CHECK_FALSE(report.now.has_value());
    CHECK_FALSE(report.trouble.empty());
  }
  const Duration took = rig.clock.now() - began;
  CHECK(took > 9s);
  CHECK(took < 15s);
  CHECK_FALSE(bench.rollback.read_again({bench.writes[0].parameter}).has_value());
}

TEST_CASE("everything can be read once more afterwards") {
  BmRig rig;
  Bench bench(rig);
  bench.run();
  const auto readings = bench.rollback.read_again({bench.writes[0].parameter});
  REQUIRE(readings.has_value());
  CHECK(readings->front().value->to_string() == "0");
}

}  // namespace
