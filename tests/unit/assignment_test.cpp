#include "commands/assignment.hpp"

#include <doctest/doctest.h>

#include <string>
#include <vector>

#include "support/rig.hpp"

using namespace spindle;
using namespace spindle::commands;

namespace {

/// "+0.1", "-5%", "value", or what is wrong.
std::string step(const std::string& text, const std::string& unit = "N.m") {
  const catalogue::Profile profile = test::product("doga-bm").profile;
  const auto typed = take_apart(text, profile);
  if (!typed) return describe(typed.error());
  const auto parameters = parameters_to_set(typed->name, profile);
  if (!parameters) return describe(parameters.error());
  const auto found = step_of(*typed, parameters->front(), unit);
  if (!found) return message_of(found.error());
  if (!*found) return "value " + typed->value;
  const ValueStep& made = **found;
  return (made.sign == Sign::plus ? "+" : "-") + made.amount.to_string() +
         (made.is_percent ? "%" : "");
}

catalogue::Value holds(const char* number) { return {.number = Decimal::parse(number).value()}; }

std::string result(const char* before, const ValueStep& change) {
  const auto made = stepped(holds(before), change);
  return made ? made->to_string() : message_of(made.error());
}

}  // namespace

TEST_CASE("what was a value before there were steps is one still") {
  CHECK(step("1.target-torque=2.8") == "value 2.8");
  CHECK(step("1.target-torque=-0.1") == "value -0.1");
  CHECK(step("1.target-torque=5%") == "value 5%");  // refused as a value of another unit
  CHECK(step("preset.1.mode=TC/AM") == "value TC/AM");
}

TEST_CASE("steps have an operator, or a sign and a percentage") {
  CHECK(step("1.target-torque+=0.1") == "+0.1");
  CHECK(step("1.target-torque-=0.1") == "-0.1");
  CHECK(step("1.target-torque+=5Ncm") == "+0.05");
  CHECK(step("1.target-torque=+5%") == "+5%");
  CHECK(step("1.target-torque=-2.5%") == "-2.5%");
  CHECK(step("1.target-torque+=5%") == "+5%");
  CHECK(step("1.target-torque-=5 %") == "-5%");
}

TEST_CASE("a percentage of what is counted in percent may mean either") {
  CHECK(step("1.torque-limit=+5%", "%").find("may be a part of the value") != std::string::npos);
  CHECK(step("1.torque-limit-=5%", "%").find("may be a part of the value") != std::string::npos);
  CHECK(step("1.torque-limit+=5", "%") == "+5");
}

TEST_CASE("a number with a plus may mean either") {
  CHECK(step("1.target-torque=+0.1") == "'+0.1' may be a value, or a step");
  CHECK(step("1.target-torque=+5Ncm") == "'+5Ncm' may be a value, or a step");
}

TEST_CASE("what is no step is refused") {
  CHECK(step("1.target-torque+=-1") == "'-1' is no step that can be added");
  CHECK(step("1.target-torque+=fast") == "'fast' is no step that can be added");
  CHECK(step("1.target-torque+=5degC").find("degC") != std::string::npos);
  CHECK(step("1.target-torque+=5degF", "degC") == "'5degF' is no step that can be added");
  CHECK(step("=5") ==
        "'=5' is not of the form NAME=VALUE; write it like "
        "preset.1.target-torque=2.71");
}

TEST_CASE("steps are exact") {
  CHECK(result("2.71", {Sign::plus, Decimal(5), true}) == "2.8455");
  CHECK(result("2.71", {Sign::minus, Decimal(1, -1), false}) == "2.61");
  CHECK(result("0.1", {Sign::plus, Decimal(2, -1), false}) == "0.3");
  CHECK(result("0", {Sign::plus, Decimal(5), true}) == "0.00");
  CHECK(result("9223372036854775807", {Sign::plus, Decimal(3, -9), true}).find("too many digits") !=
        std::string::npos);
  CHECK_FALSE(stepped({.content = catalogue::Content::none}, {}).has_value());
  CHECK(step_in_words(holds("2.71"), {Sign::plus, Decimal(5), true}, Decimal(28455, -4)) ==
        "2.71 + 5 % is 2.8455");
}

TEST_CASE("a pattern means named parameters, and never numbered ones") {
  const catalogue::Profile profile = test::product("doga-bm").profile;
  CHECK(parameters_to_set("preset.*.speed", profile)->size() > 10);
  CHECK_FALSE(parameters_to_set("p2*", profile).has_value());
  CHECK(parameters_to_set("p2", profile)->front().name == "p2");
}

TEST_CASE("lines of a file are told by their numbers") {
  const auto lines = assignments_in("# head\na = 1\r\n\n  b+=2\n c - = 3\nnonsense", "f.set");
  REQUIRE(lines.size() == 4);
  CHECK(lines[0].text == "a=1");
  CHECK(lines[0].place == "f.set:2");
  CHECK(lines[1].text == "b+=2");
  CHECK(lines[2].text == "c-=3");
  CHECK(lines[3].text == "nonsense");
  CHECK(lines[3].place == "f.set:6");
}

TEST_CASE("all faults are one error, whose first one is told in full") {
  const Error all = all_of({Error{.code = Errc::bad_value, .message = "one", .name = "f:1"},
                            Error{.code = Errc::usage, .message = "two", .name = "f:2"}});
  CHECK(describe(all) == "f:1: one");
  CHECK(all.details == std::vector<std::string>{"f:2: two"});
}
