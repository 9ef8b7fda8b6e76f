#include "spindle/work/change.hpp"

#include <doctest/doctest.h>

#include <chrono>
#include <deque>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "support/edit_list.hpp"
#include "support/memory_disk.hpp"
#include "support/rig.hpp"

namespace {

using namespace spindle;
using namespace std::chrono_literals;
using catalogue::Parameter;
using catalogue::Value;
using device::Device;
using device::RollbackResult;
using device::WriteResult;
using modbus::ExceptionCode;
using modbus::Pdu;

/// What a bank of registers does with one write.
struct Reply {
  std::optional<ExceptionCode> exception = std::nullopt;  ///< empty: acknowledged
  bool silent = false;                                    ///< not answered at all
  std::optional<Duration> acts = 0ms;  ///< how long after it was sent; empty: never
};

/// A device that acknowledges, refuses, keeps silent and acts late as it is told.
class Bank final : public sim::Server {
 public:
  std::optional<Pdu> answer(sim::ConnectionId /*connection*/, modbus::UnitId /*unit*/,
                            const Pdu& request, TimePoint now) override {
    advance(now);
    const auto parsed = modbus::parse_request(request).value();
    if (const auto* read = std::get_if<modbus::ReadRequest>(&parsed)) {
      Registers words;
      for (std::uint16_t at = 0; at < read->count; ++at) {
        words.push_back(registers[static_cast<std::uint16_t>(read->first.value + at)]);
      }
      return modbus::read_response(read->table, words);
    }
    if (const auto* one = std::get_if<modbus::WriteSingleRequest>(&parsed)) {
      return written(request, one->address, {one->value}, request, now);
    }
    const auto& many = std::get<modbus::WriteMultipleRequest>(parsed);
    const auto count = static_cast<std::uint16_t>(many.values.size());
    return written(request, many.first, many.values,
                   modbus::write_multiple_response(many.first, count), now);
  }
  void advance(TimePoint now) override {
    std::erase_if(pending_, [&](const Late& late) {
      if (late.when <= now) registers[late.address] = late.value;
      return late.when <= now;
    });
  }
  [[nodiscard]] std::optional<TimePoint> next_change() const override { return std::nullopt; }
  std::vector<sim::Push> take_pushes() override { return {}; }
  void connected(sim::ConnectionId /*connection*/) override {}
  void disconnected(sim::ConnectionId /*connection*/) override {}

  std::deque<Reply> replies = {};  ///< to the next writes; then all are acknowledged
  std::map<std::uint16_t, std::uint16_t> registers = {{0, 10}};

 private:
  struct Late {
    TimePoint when;
    std::uint16_t address;
    std::uint16_t value;
  };

  std::optional<Pdu> written(const Pdu& request, modbus::RegisterAddress first,
                             const Registers& words, Pdu acknowledged, TimePoint now) {
    Reply reply;
    if (!replies.empty()) {
      reply = replies.front();
      replies.pop_front();
    }
    for (std::size_t at = 0; at < words.size() && reply.acts; ++at) {
      pending_.push_back(
          {now + *reply.acts, static_cast<std::uint16_t>(first.value + at), words[at]});
    }
    advance(now);
    if (reply.silent) return std::nullopt;
    if (!reply.exception) return acknowledged;
    return modbus::exception_response(request.function,
                                      static_cast<std::uint8_t>(*reply.exception));
  }

  std::vector<Late> pending_ = {};
};

catalogue::Profile bank_profile() {
  catalogue::Profile profile;
  profile.id = "bank";
  profile.link.answer = 300ms;
  profile.link.retries = 0;
  profile.link.max_write = 16;
  Parameter a;
  a.name = "a";
  a.access = catalogue::Access::read_write;
  Parameter wide = a;
  wide.name = "wide";
  wide.address = {10};
  wide.encoding.kind = catalogue::Kind::u32;
  profile.parameters = {a, wide};
  return profile;
}

/// One command that changes the bank.
struct Bench : test::Rig<Bank> {
  Bench() : Rig({bank_profile()}, std::make_unique<Bank>()) {}

  device::Written set(int value, std::size_t at = 0) {
    const Parameter& parameter = profile.parameters[at];
    const auto before = device.read_each({parameter}, device::Limits::skip).value();
    wire.requests.clear();
    return changer.make(parameter, before.front().value.value(), Value{Decimal(value), {}});
  }
  std::vector<device::PutBackReport> put_back() {
    device::Rollback rollback(
        device, [this](Duration) { return connect(); }, clock);
    return changer.put_back(rollback);
  }
  [[nodiscard]] std::size_t writes() const {
    return wire.count(modbus::FunctionCode::write_single_register) +
           wire.count(modbus::FunctionCode::write_multiple_registers);
  }
  /// "begun 10 55", "written 10 55"
  std::vector<std::string> records() const {
    std::vector<std::string> lines;
    std::istringstream written(memory.text("/state/changes.jsonl"));
    for (std::string text; std::getline(written, text);) {
      const auto change = nlohmann::json::parse(text);
      lines.push_back(change.at("result").get<std::string>() + " " + change.at("old").dump() + " " +
                      change.at("new").dump());
    }
    return lines;
  }

  test::MemoryDisk memory = {};
  Disk disk = memory.functions();
  Device device = open();
  work::ChangeLog log = work::ChangeLog({.command = "set", .target = "bank", .folder = "/state"},
                                        disk, clock, [](const std::string&) {});
  work::Target target = {};
  work::Changer changer = work::Changer(device, log, target);
};

using Lines = std::vector<std::string>;

}  // namespace

TEST_CASE("what became of a write is what the device holds, whatever it answered") {
  struct Row {
    std::string what;
    std::deque<Reply> replies;
    WriteResult result;
    std::string record;
    std::size_t writes;
    std::string error;  ///< part of it; empty: none
  };
  const auto refuses = [](ExceptionCode code, std::optional<Duration> acts) {
    return Reply{.exception = code, .acts = acts};
  };
  using Code = ExceptionCode;
  const Reply busy = refuses(Code::server_device_busy, std::nullopt);
  const std::vector<Row> rows = {
      {"acknowledge (05), and done",
       {refuses(Code::acknowledge, 0ms)},
       WriteResult::written,
       "written 10 55",
       1,
       ""},
      {"acknowledge (05), done in a while",
       {refuses(Code::acknowledge, 300ms)},
       WriteResult::written,
       "written 10 55",
       1,
       ""},
      {"acknowledge (05), and never done",
       {refuses(Code::acknowledge, std::nullopt)},
       WriteResult::mismatch,
       "mismatch 10 10",
       1,
       "exception 05 (acknowledge); it still holds 10"},
      {"busy (06) once", {busy}, WriteResult::written, "written 10 55", 2, ""},
      {"busy (06) for ever",
       {busy, busy, busy, busy, busy, busy, busy, busy, busy},
       WriteResult::refused,
       "refused 10 10",
       3,
       "it still holds 10"},
      {"busy (06), but done all the same",
       {refuses(Code::server_device_busy, 0ms), busy, busy, busy, busy, busy},
       WriteResult::written,
       "written 10 55",
       3,
       ""},
      {"no path (0A)",
       {refuses(Code::gateway_path_unavailable, std::nullopt)},
       WriteResult::refused,
       "refused 10 10",
       1,
       "it still holds 10"},
      {"no path (0A), but done",
       {refuses(Code::gateway_path_unavailable, 0ms)},
       WriteResult::written,
       "written 10 55",
       1,
       ""},
      {"no answer behind a gateway (0B), but done",
       {refuses(Code::gateway_target_failed_to_respond, 100ms)},
       WriteResult::written,
       "written 10 55",
       1,
       ""},
      {"no answer behind a gateway (0B), and not done: repeated once",
       {refuses(Code::gateway_target_failed_to_respond, std::nullopt)},
       WriteResult::written,
       "written 10 55",
       2,
       ""},
      {"no answer, but done", {{.silent = true}}, WriteResult::written, "written 10 55", 1, ""},
      {"no answer, twice",
       {{.silent = true, .acts = std::nullopt}, {.silent = true, .acts = std::nullopt}},
       WriteResult::mismatch,
       "mismatch 10 10",
       2,
       "it still holds 10"},
      {"a refusal (03)",
       {refuses(Code::illegal_data_value, std::nullopt)},
       WriteResult::refused,
       "refused 10 10",
       1,
       "exception 03"},
      {"a failure (04) in the middle",
       {refuses(Code::server_device_failure, 0ms)},
       WriteResult::written,
       "written 10 55",
       1,
       ""},
      {"a failure (04)",
       {refuses(Code::server_device_failure, std::nullopt)},
       WriteResult::refused,
       "refused 10 10",
       1,
       "exception 04"},
  };
  for (const Row& row : rows) {
    CAPTURE(row.what);
    Bench bench;
    bench.tool->replies = row.replies;
    const auto written = bench.set(55);
    CHECK(written.result == row.result);
    CHECK(bench.writes() == row.writes);
    CHECK(bench.records() == Lines{"begun 10 55", row.record});
    const std::string text = written.error ? describe(*written.error) : std::string();
    CAPTURE(text);
    CHECK(row.error.empty() == text.empty());
    CHECK(text.find(row.error) != std::string::npos);
  }
}

TEST_CASE("a value that reads right is not waited for, and one that acts late is") {
  struct Row {
    Duration acts;
    std::optional<Duration> link;
    std::optional<Duration> own;
    WriteResult result;
    Duration longest;
  };
  const std::vector<Row> rows = {
      {0ms, {}, {}, WriteResult::written, 5ms},
      {300ms, {}, {}, WriteResult::written, 400ms},
      {600ms, {}, {}, WriteResult::mismatch, 520ms},
      {600ms, 1s, {}, WriteResult::written, 1s},
      {600ms, 100ms, 2s, WriteResult::written, 1s},
      {300ms, 1s, 100ms, WriteResult::mismatch, 120ms},
  };
  for (const Row& row : rows) {
    CAPTURE(row.acts.count());
    Bench bench;
    if (row.link) bench.profile.link.settle = *row.link;
    test::edit(bench.profile.parameters, 0,
               [&](Parameter& parameter) { parameter.settle = row.own; });
    bench.tool->replies = {{.acts = row.acts}};
    const TimePoint began = bench.clock.now();
    CHECK(bench.set(55).result == row.result);
    CHECK(bench.clock.now() - began <= row.longest);
  }
}

TEST_CASE("a write that acts after it was given up is put back all the same") {
  Bench bench;
  bench.tool->replies = {{.acts = 700ms}, {.acts = 700ms}};
  bench.profile.link.settle = 500ms;
  REQUIRE(bench.set(55).result == WriteResult::mismatch);
  REQUIRE(bench.changer.sent().size() == 1);
  bench.put_back();
  bench.clock.advance(2s);
  CHECK(bench.read(0) == 10);
  CHECK(bench.changer.sent().empty());
}

TEST_CASE("a write that acts behind its put-back is put back once more") {
  Bench bench;
  bench.tool->replies = {{.acts = 800ms}, {.acts = 0ms}};
  REQUIRE(bench.set(55).result == WriteResult::mismatch);
  const auto reports = bench.put_back();
  CHECK(reports.front().result == RollbackResult::done);
  CHECK(bench.read(0) == 10);
  CHECK(bench.writes() == 3);
}

TEST_CASE("what is put back is proven after the settling time, and recorded") {
  Bench bench;
  bench.tool->replies = {{.acts = 300ms}, {.acts = 300ms}};
  REQUIRE(bench.set(55).result == WriteResult::written);
  const auto reports = bench.put_back();
  REQUIRE(reports.size() == 1);
  CHECK(reports[0].result == RollbackResult::done);
  CHECK(bench.read(0) == 10);
  CHECK(bench.records() ==
        Lines{"begun 10 55", "written 10 55", "begun 55 10", "rolled-back 55 10"});
}

TEST_CASE("what cannot be put back is recorded with what the tool holds") {
  Bench bench;
  bench.tool->replies = {{}, {.exception = ExceptionCode::illegal_data_value, .acts = {}}};
  bench.set(55);
  CHECK(bench.put_back().front().result == RollbackResult::refused);
  CHECK(bench.records() ==
        Lines{"begun 10 55", "written 10 55", "begun 55 10", "not-rolled-back 10 55"});
}

TEST_CASE("a refused write leaves nothing to be put back, and one in doubt does") {
  for (const auto& [code, count] : {std::pair(ExceptionCode::illegal_data_value, 0U),
                                    {ExceptionCode::acknowledge, 1U},
                                    {ExceptionCode::gateway_path_unavailable, 1U}}) {
    Bench bench;
    bench.tool->replies = {{.exception = code, .acts = std::nullopt}};
    bench.set(55);
    CHECK(bench.changer.sent().size() == count);
  }
}

TEST_CASE("a product that takes one register a request gets two words in their order") {
  Bench bench;
  bench.profile.link.max_write = 1;
  REQUIRE(bench.set(70000, 1).result == WriteResult::written);
  REQUIRE(bench.wire.requests.size() == 3);
  CHECK(bench.wire.requests[0].pdu == modbus::write_request({10}, std::uint16_t{1}));
  CHECK(bench.wire.requests[1].pdu == modbus::write_request({11}, std::uint16_t{4464}));
  CHECK(bench.wire.count(modbus::FunctionCode::write_multiple_registers) == 0);
}

TEST_CASE("half a pair that was written is told") {
  Bench bench;
  bench.profile.link.max_write = 1;
  bench.tool->replies = {{}, {.exception = ExceptionCode::illegal_data_value, .acts = {}}};
  const auto written = bench.set(70000, 1);
  CHECK(written.result == WriteResult::coerced);
  CHECK(written.now->to_string() == "65536");
  CHECK(bench.changer.sent().size() == 1);
}

TEST_CASE("a pair that is never split is not written by a product that takes one register") {
  Bench bench;
  bench.profile.link.max_write = 1;
  bench.profile.link.even_pairs = true;
  const auto written = bench.set(70000, 1);
  CHECK(written.result == WriteResult::refused);
  CHECK(written.error->status() == ExitStatus::usage);
  CHECK(bench.wire.requests.empty());
  CHECK(bench.changer.sent().empty());
}
