#include "spindle/sim/fault_plan.hpp"

#include <doctest/doctest.h>

#include <set>
#include <string>
#include <vector>

using namespace spindle;
using namespace spindle::sim;
using namespace std::chrono_literals;

namespace {

// The name alone, or with an argument where the kind cannot do without.
std::string plainest(const FaultHelp& help) {
  std::string text(to_text(help.kind));
  if (help.syntax.ends_with("=DURATION")) text += "=20ms";
  if (help.syntax.ends_with("=N")) text += "=2";
  return text;
}

}  // namespace

TEST_CASE("every kind has help and reads back its own name") {
  const std::vector<FaultHelp> all = fault_help();
  CHECK(all.size() == static_cast<std::size_t>(FaultKind::not_a_number) + 1);
  std::set<FaultKind> seen;
  for (const FaultHelp& help : all) {
    CAPTURE(help.syntax);
    CHECK(seen.insert(help.kind).second);
    CHECK(help.syntax.starts_with(to_text(help.kind)));
    CHECK_FALSE(help.meaning.empty());
    const auto fault = parse_fault(plainest(help));
    REQUIRE(fault.has_value());
    CHECK(fault->kind == help.kind);
    CHECK(fault->at == 0);
    CHECK(fault->every == 0);
  }
}

TEST_CASE("arguments and times are read") {
  struct Row {
    std::string text;
    FaultKind kind;
    std::optional<std::uint16_t> number;
    std::optional<Duration> duration;
    bool pending;
    std::uint32_t at;
    std::uint32_t every;
  };
  const std::vector<Row> rows = {
      {"late=1500ms@3", FaultKind::late, {}, 1500ms, false, 3, 0},
      {"latency=2s", FaultKind::latency, {}, 2s, false, 0, 0},
      {"lost@every:5", FaultKind::lost, {}, {}, false, 0, 5},
      {"push-before=0x0001", FaultKind::push_before, 1, {}, false, 0, 0},
      {"push-before=pending@2", FaultKind::push_before, {}, {}, true, 2, 0},
      {"push-inside", FaultKind::push_inside, {}, {}, false, 0, 0},
      {"split", FaultKind::split, {}, {}, false, 0, 0},
      {"split=7", FaultKind::split, 7, {}, false, 0, 0},
      {"exception=0x0E@2", FaultKind::exception, 0x0E, {}, false, 2, 0},
      {"wrong-transaction=65535", FaultKind::wrong_transaction, 65535, {}, false, 0, 0},
  };
  for (const Row& row : rows) {
    CAPTURE(row.text);
    const auto fault = parse_fault(row.text);
    REQUIRE(fault.has_value());
    CHECK(fault->kind == row.kind);
    CHECK(fault->number == row.number);
    CHECK(fault->duration == row.duration);
    CHECK(fault->pending_transaction == row.pending);
    CHECK(fault->at == row.at);
    CHECK(fault->every == row.every);
  }
}

TEST_CASE("a number that is not given is the kind's own") {
  struct Row {
    std::string text;
    std::uint16_t number;
  };
  const std::vector<Row> rows = {
      {"split", 1},
      {"wrong-unit", 77},
      {"wrong-transaction", 1},
      {"fixed-transaction", 0},
      {"wrong-protocol", 1},
      {"wrong-length", 1},
      {"garbage", 16},
      {"wrong-header-length", 2},
      {"wrong-function", 0x65},
      {"noise", 1},
      {"store-other", 1},
      {"split=9", 9},
  };
  for (const Row& row : rows) {
    CAPTURE(row.text);
    CHECK(number_of(*parse_fault(row.text)) == row.number);
  }
}

TEST_CASE("what cannot be meant is refused") {
  struct Row {
    std::string text;
    std::string says;
  };
  const std::vector<Row> rows = {
      {"", "there is none of that name"},
      {"slit", "there is none of that name"},
      {"wrong_unit", "there is none of that name"},
      {"late", "late needs a duration"},
      {"late=", "late needs a duration"},
      {"latency=7", "latency needs a duration"},
      {"exception", "exception takes a number from 0 to 255"},
      {"exception=256", "exception takes a number from 0 to 255"},
      {"exception=e", "exception takes a number"},
      {"split=0", "split takes a number from 1"},
      {"split=1ms", "split takes a number"},
      {"lost=1", "lost takes no argument"},
      {"lost=", "lost takes no argument"},
      {"wrong-unit=pending", "wrong-unit takes a number"},
      {"push-after=soon", "push-after takes a number from 0 to 65535"},
      {"lost@", "behind '@' stands the number of an answer"},
      {"lost@0", "behind '@' stands the number of an answer"},
      {"lost@every:0", "behind '@' stands the number of an answer"},
      {"lost@every", "behind '@' stands the number of an answer"},
      {"lost@1@2", "behind '@' stands the number of an answer"},
  };
  for (const Row& row : rows) {
    CAPTURE(row.text);
    const auto fault = parse_fault(row.text);
    REQUIRE_FALSE(fault.has_value());
    CHECK(fault.error().code == Errc::bad_value);
    CHECK(fault.error().message.find("fault '" + row.text + "'") == 0);
    CHECK(fault.error().message.find(row.says) != std::string::npos);
  }
  CHECK(parse_fault("splt").error().hint.find("split") != std::string::npos);
}

TEST_CASE("a fault strikes the answers that it names") {
  struct Row {
    std::string text;
    std::vector<std::uint32_t> struck;  // of the answers 1 to 6
  };
  const std::vector<Row> rows = {
      {"lost", {1, 2, 3, 4, 5, 6}}, {"lost@1", {1}},       {"lost@4", {4}},
      {"lost@every:2", {2, 4, 6}},  {"lost@every:5", {5}},
  };
  for (const Row& row : rows) {
    CAPTURE(row.text);
    const Fault fault = *parse_fault(row.text);
    std::vector<std::uint32_t> struck;
    for (std::uint32_t answer = 1; answer <= 6; ++answer) {
      if (fault.applies_to(answer)) struck.push_back(answer);
    }
    CHECK(struck == row.struck);
  }
}
