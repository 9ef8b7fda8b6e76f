#include <doctest/doctest.h>

#include "spindle/catalogue/unit.hpp"

using namespace spindle;
using namespace spindle::catalogue;

namespace {

/// The number in the unit, or why there is none.
std::string in(std::string_view unit, std::string_view text) {
  const auto converted = convert_typed(text, unit);
  return converted ? converted->text : message_of(converted.error());
}

std::string hint(std::string_view unit, std::string_view text) {
  const auto converted = convert_typed(text, unit);
  return converted ? std::string() : converted.error().hint;
}

}  // namespace

TEST_CASE("a quantity is kept whatever unit it is typed in") {
  struct Case {
    std::string_view unit;
    std::string_view typed;
    std::string_view number;
  };
  const Case cases[] = {
      {"W", "1.5kW", "1500"},
      {"W", "1.5 kW", "1500"},
      {"kW", "5W", "0.005"},
      {"MW", "5mW", "0.000000005"},
      {"mW", "5MW", "5000000000"},
      {"uA", "1 µA", "1"},
      {"V", "-2.5kV", "-2500"},
      {"Wh", "7200J", "2"},
      {"J", "1kWh", "3600000"},
      {"N.m", "1kgf.cm", "0.0980665"},
      {"Nm", "1 kgf·m", "9.80665"},
      {"N.m", "1lbf.in", "0.1129848290276167"},
      {"N.m", "2 in-lb", "0.2259696580552334"},
      {"N.m", "1ft.lb", "1.3558179483314004"},
      {"N.m", "16ozf.in", "0.1129848290276167"},
      {"lbf.in", "1lbf.ft", "12"},
      {"ozf.in", "1lbf.in", "16"},
      {"kgf.cm", "0.980665N.m", "10"},
      {"cN.m", "0.5 Nm", "50"},
      {"mN.m", "0.5 N·m", "500"},
      {"rpm", "2 rev/s", "120"},
      {"rev/s", "90rpm", "1.5"},
      {"r/min", "90rpm", "90"},
      {"kHz", "50Hz", "0.05"},
      {"ms", "1.5s", "1500"},
      {"min", "0.5h", "30"},
      {"degC", "300K", "26.85"},
      {"degC", "212 °F", "100"},
      {"degF", "100degC", "212"},
      {"K", "-40°F", "233.15"},
      {"bar", "250kPa", "2.5"},
      {"mm", "1in", "25.4"},
      {"kg", "1lb", "0.45359237"},
      {"%", "50%", "50"},
      {"steps/s", "7 steps/s", "7"},
      {"W", "1e3W", "1e3"},
      {"Pa", "1psi", "6894.757293168361337"},
      {"rev/s", "100rpm", "1.6666666666666666667"},
  };
  for (const Case& row : cases) {
    CAPTURE(row.typed);
    CHECK(in(row.unit, row.typed) == row.number);
  }
}

TEST_CASE("what was converted is told, and nothing where it was not") {
  CHECK(convert_typed("1.5 kW", "W")->note == "1.5 kW is 1500 W");
  CHECK(convert_typed("1.5kW", "W")->note == "1.5 kW is 1500 W");
  CHECK(convert_typed("5 Nm", "N.m")->note.empty());
  CHECK(convert_typed("5", "N.m")->note.empty());
}

TEST_CASE("what is no number with a unit stays as it is") {
  for (const std::string_view text :
       {"5", "-1.5", "0x1F", "1,5", "1.000,5", "on", "", "1e5", "2026-11-22", "5 ", "1/2", "NaN"}) {
    CAPTURE(text);
    CHECK(in("W", text) == text);
  }
  CHECK(in("", "12abc") == "12abc");
}

TEST_CASE("another quantity is refused, and no unit is taken for another one that looks like it") {
  CHECK(in("W", "5 Nm") == "5 Nm is a torque, and this is a power in W");
  CHECK(in("W", "5VA") == "5 VA is an apparent power, and this is a power in W");
  CHECK(in("Hz", "5rpm") == "5 rpm is a speed of rotation, and this is a frequency in Hz");
  CHECK(in("deg", "1rad") == "1 rad is an angle in radians, and this is an angle in deg");
  CHECK(in("steps/s", "5W") == "5 W is a power, and this is in steps/s");
  CHECK(in("W", "5kw") == "'kw' is no unit that is known, and this is in W");
  CHECK(hint("W", "5kw") == "case matters: did you mean kW?");
  CHECK(hint("W", "5mw") == "case matters: did you mean mW or MW?");
  CHECK(hint("V", "5mw") == "write the number in V");
  CHECK(hint("W", "5watts") == "write the number in W");
  CHECK(in("", "5V") == "'5V' has a unit, and the parameter has none that is known");
  CHECK(in("W", "18446744073709551615GW") == "18446744073709551615 GW has too many digits in W");
}

TEST_CASE("units of torque are told from others") {
  for (const std::string unit :
       {"N.m", "cN.m", "Nm", "kgf.cm", "kgf.m", "lbf.in", "ozf.in", "in-lb"}) {
    CAPTURE(unit);
    CHECK(is_torque(unit));
  }
  for (const std::string unit : {"", "N", "m", "rpm", "W", "torque", "nothing"}) {
    CAPTURE(unit);
    CHECK_FALSE(is_torque(unit));
  }
}
