#include "spindle/catalogue/value.hpp"

#include <doctest/doctest.h>

#include <string>
#include <vector>

using namespace spindle;
using namespace spindle::catalogue;

namespace {

Parameter make(Kind kind, const char* scale) {
  return {.name = "x",
          .title = {},
          .encoding = {kind, *Decimal::parse(scale)},
          .unit = {},
          .access = Access::read_write,
          .source = {},
          .note = {}};
}

Parameter torque() {
  Parameter parameter = make(Kind::u16, "0.01");
  parameter.range = {Decimal(0), Decimal::parse("6.00")};
  return parameter;
}

Parameter mode() {
  Parameter parameter = make(Kind::u16, "1");
  parameter.labels = {{0, "TC/AM"}, {1, "AC/TM"}};
  return parameter;
}

std::string decoded(const Parameter& parameter, const Registers& registers) {
  const auto value = decode(parameter, registers);
  return value ? value->to_string() : describe(value.error());
}

std::string parsed(const Parameter& parameter, std::string_view text) {
  const auto value = parse_value(parameter, text);
  return value ? value->to_string() : message_of(value.error());
}

}  // namespace

TEST_CASE("decode: exact numbers with the decimals of the scale") {
  struct Row {
    Kind kind;
    const char* scale;
    Registers registers;
    const char* text;
  };
  const std::vector<Row> rows = {
      {Kind::u16, "0.01", {0x010F}, "2.71"},   // DOGA 60427 §3.1: 010Fh is 2.71
      {Kind::u16, "0.01", {0x03E8}, "10.00"},  // DOGA 60427 §3.1: 03E8h is 10.00 %
      {Kind::u16, "1", {0xFFFF}, "65535"},     // unsigned
      {Kind::i16, "0.01", {0xFFFB}, "-0.05"},  // two's complement
      {Kind::i16, "1", {0x8000}, "-32768"},    //
      {Kind::u32, "1", {0x0001, 0x0000}, "65536"},
      {Kind::i32, "1", {0x0000, 0x03E8}, "1000"},    // BLV 00CE/00CF, reply +1000
      {Kind::i32, "1", {0xFFFF, 0xFC18}, "-1000"},   // BLV 00CE/00CF, reply -1000
      {Kind::i32, "1", {0xFFFF, 0xD8F0}, "-10000"},  // AR FLEX manual, function 03h example
      {Kind::u32, "0.1", {0xFFFF, 0xFFFF}, "429496729.5"},
  };
  for (const Row& row : rows) {
    CAPTURE(row.text);
    const Parameter parameter = make(row.kind, row.scale);
    CHECK(decoded(parameter, row.registers) == row.text);
    CHECK(encode(parameter, {*Decimal::parse(row.text)}) == row.registers);
  }
}

TEST_CASE("decode: the number of registers must fit") {
  for (const Registers& registers : {Registers{}, Registers{1, 2}}) {
    const auto value = decode(make(Kind::u16, "1"), registers);
    REQUIRE_FALSE(value.has_value());
    CHECK(value.error().code == Errc::internal);
  }
  CHECK_FALSE(decode(make(Kind::i32, "1"), Registers{1}).has_value());
}

TEST_CASE("encode undoes decode for every word of every 16-bit encoding") {
  for (const Kind kind : {Kind::u16, Kind::i16}) {
    for (const char* scale : {"1", "0.1", "0.01", "10", "0.5"}) {
      const Parameter parameter = make(kind, scale);
      unsigned wrong = 0;
      for (unsigned word = 0; word <= 0xFFFF; ++word) {
        const Registers registers = {static_cast<std::uint16_t>(word)};
        const auto value = decode(parameter, registers);
        if (!value || encode(parameter, {value->number}) != registers) ++wrong;
      }
      CAPTURE(scale);
      CHECK(wrong == 0);
    }
  }
}

TEST_CASE("encode undoes decode for 32-bit words around every power of two") {
  for (const Kind kind : {Kind::u32, Kind::i32}) {
    const Parameter parameter = make(kind, "0.001");
    for (unsigned bit = 0; bit < 32; ++bit) {
      for (const std::uint32_t offset : {0U, 1U, 0xFFFFFFFFU}) {
        const std::uint32_t word = (std::uint32_t{1} << bit) + offset;
        const Registers registers = {static_cast<std::uint16_t>(word >> 16U),
                                     static_cast<std::uint16_t>(word)};
        const auto value = decode(parameter, registers);
        REQUIRE(value.has_value());
        CHECK(encode(parameter, {value->number}) == registers);
      }
    }
  }
}

TEST_CASE("encode refuses what does not fit, and never rounds") {
  struct Row {
    Kind kind;
    const char* scale;
    const char* number;
    Errc code;
    const char* message;
  };
  const std::vector<Row> rows = {
      {Kind::u16, "0.01", "2.715", Errc::bad_value, "2.715 is between two steps of 0.01"},
      {Kind::u16, "10", "15", Errc::bad_value, "15 is between two steps of 10"},
      {Kind::u16, "0.01", "655.36", Errc::out_of_range,
       "655.36 is above 655.35, the most that u16 can hold"},
      {Kind::u16, "1", "-1", Errc::out_of_range, "-1 is below 0, the least that u16 can hold"},
      {Kind::i16, "1", "32768", Errc::out_of_range,
       "32768 is above 32767, the most that i16 can hold"},
      {Kind::i32, "1", "-2147483649", Errc::out_of_range,
       "-2147483649 is below -2147483648, the least that i32 can hold"},
      {Kind::u32, "1", "4294967296", Errc::out_of_range,
       "4294967296 is above 4294967295, the most that u32 can hold"},
  };
  for (const Row& row : rows) {
    CAPTURE(row.number);
    const auto registers = encode(make(row.kind, row.scale), {*Decimal::parse(row.number)});
    REQUIRE_FALSE(registers.has_value());
    CHECK(registers.error().code == row.code);
    CHECK(registers.error().message == row.message);
    CHECK(registers.error().name == "x");
  }
}

TEST_CASE("parse_value: numbers") {
  CHECK(parsed(torque(), "2.71") == "2.71");
  CHECK(parsed(torque(), "3") == "3.00");
  CHECK(parsed(torque(), "6.000") == "6.00");
  CHECK(parsed(torque(), "0") == "0.00");
  CHECK(parsed(torque(), "9.99") == "9.99 is above 6.00, the maximum of the profile");
  CHECK(parsed(torque(), "-1") == "-1 is below 0, the minimum of the profile");
  CHECK(parsed(torque(), "2.715") == "2.72");
  CHECK(parsed(torque(), "two") == "'two' is not a number");
  CHECK(parsed(torque(), "") == "'' is not a number");
  CHECK(parsed(torque(), "1e1") == "'1e1' is not a number");
  CHECK(parsed(torque(), "0x10") == "'0x10' is not a number");  // of which step?
  CHECK(parsed(make(Kind::u16, "1"), "0x1F") == "31");
  CHECK(parsed(make(Kind::u16, "1"), "010") == "10");
  CHECK(parsed(make(Kind::i16, "1"), "0x8000") == "'0x8000' is not a number");
}

TEST_CASE("parse_value: a decimal comma, or what parts thousands, is refused and never left out") {
  for (const std::string text :
       {"2,8", "2,80", "1,000", "1.000,5", "1 000", "1'000", "1\u00a0000", "1\u202f000", "2\u00b78",
        "\u0662.\u0668", "2.8.1", "2. 8", "2.8 N.m"}) {
    CAPTURE(text);
    for (const char* const scale : {"1", "0.01"}) {
      const auto value = parse_value(make(Kind::u16, scale), text);
      REQUIRE_FALSE(value);
      CHECK(value.error().code == Errc::bad_value);
      CHECK(value.error().message == "'" + text + "' is not a number");
      CHECK(value.error().hint == (std::string(scale) == "1"
                                       ? "write it in digits without separators, such as 2500"
                                       : "write it in digits with a decimal point, such as 2.5"));
    }
  }
}

TEST_CASE("parse_value: labels") {
  CHECK(parsed(mode(), "AC/TM") == "AC/TM");
  CHECK(parsed(mode(), "ac/tm") == "AC/TM");
  CHECK(parse_value(mode(), "ac/tm")->number == Decimal(1));
  CHECK(parsed(mode(), "0") == "TC/AM");
  CHECK(parsed(mode(), "2") == "'2' is none of its labels");

  const auto misspelt = parse_value(mode(), "TCAM");
  REQUIRE_FALSE(misspelt.has_value());
  CHECK(misspelt.error().code == Errc::bad_value);
  CHECK(misspelt.error().message == "'TCAM' is none of its labels");
  CHECK(misspelt.error().hint == "it has TC/AM (0), AC/TM (1); did you mean 'TC/AM'?");
}

TEST_CASE("parse_value: an enumeration with a range has numbers beside its labels") {
  Parameter level = make(Kind::u16, "1");
  level.labels = {{0, "off"}};
  level.range = {Decimal(0), Decimal(100)};
  CHECK(parsed(level, "off") == "off");
  CHECK(parsed(level, "55") == "55");
  CHECK(parsed(level, "101") == "101 is above 100, the maximum of the profile");
}

TEST_CASE("check_range: either side may be open") {
  Parameter parameter = make(Kind::i16, "1");
  CHECK(check_range(parameter, {Decimal(99999)}).has_value());
  parameter.range.minimum = Decimal(5);
  CHECK(check_range(parameter, {Decimal(5)}).has_value());
  CHECK(check_range(parameter, {Decimal(99999)}).has_value());
  const auto below = check_range(parameter, {Decimal(4)});
  REQUIRE_FALSE(below.has_value());
  CHECK(below.error().code == Errc::out_of_range);
  CHECK(below.error().message == "4 is below 5, the minimum of the profile");
}

namespace {

catalogue::Parameter bit_field() {
  catalogue::Parameter parameter;
  parameter.name = "command.word";
  parameter.encoding.kind = catalogue::Kind::u32;
  parameter.bits = {{0, "M0"}, {1, "M1"}, {3, "FWD", 0}, {4, "REV", 0}, {3, "START/STOP", 1}};
  parameter.bits_by = "motor.mode";
  return parameter;
}

}  // namespace

TEST_CASE("a bit field is shown by the names that count") {
  const auto two_wire = catalogue::with_bits_for(bit_field(), 0);
  const Registers word = {0, 0x0A};
  CHECK(catalogue::decode(two_wire, word)->to_string() == "M1 FWD");
  CHECK(catalogue::decode(catalogue::with_bits_for(bit_field(), 1), word)->label ==
        "M1 START/STOP");
  CHECK(catalogue::decode(catalogue::with_bits_for(bit_field(), std::nullopt), word)->label ==
        "M1 bit3");
  CHECK(catalogue::decode(bit_field(), word)->label == "M1 bit3");
  CHECK(catalogue::decode(two_wire, Registers{0x8000, 0})->label == "bit31");
  CHECK(catalogue::decode(two_wire, Registers{0, 0})->to_string() == "0");
  CHECK(two_wire.bits_by.empty());
}

TEST_CASE("a bit field is typed by names or as a number") {
  const auto two_wire = catalogue::with_bits_for(bit_field(), 0);
  CHECK(catalogue::parse_value(two_wire, "M1+fwd")->number == Decimal(0x0A));
  CHECK(catalogue::parse_value(two_wire, "rev,M0")->number == Decimal(0x11));
  CHECK(catalogue::parse_value(two_wire, "0x2A")->number == Decimal(0x2A));
  CHECK(catalogue::parse_value(two_wire, "M0+M0")->number == Decimal(1));
  const auto wrong = catalogue::parse_value(two_wire, "M1+START/STOP");
  REQUIRE_FALSE(wrong);
  CHECK(wrong.error().code == Errc::bad_value);
  CHECK(wrong.error().message == "'START/STOP' is none of its bits");
  CHECK(wrong.error().hint == "it has M0, M1, FWD, REV");
  CHECK_FALSE(catalogue::parse_value(two_wire, "M1+"));
}

TEST_CASE("what is excepted from a range is refused") {
  catalogue::Parameter speed;
  speed.encoding.kind = catalogue::Kind::u32;
  speed.range = {Decimal(0), Decimal(4000)};
  speed.except = catalogue::Range{Decimal(1), Decimal(79)};
  for (const char* good : {"0", "80", "4000"}) CHECK(catalogue::parse_value(speed, good));
  for (const char* bad : {"1", "79", "4001"}) {
    const auto refused = catalogue::parse_value(speed, bad);
    REQUIRE_FALSE(refused);
    CHECK(refused.error().code == Errc::out_of_range);
  }
}

TEST_CASE("a code is shown as documents print it") {
  catalogue::Parameter alarm;
  alarm.notation = catalogue::Notation::hexadecimal;
  CHECK(catalogue::decode(alarm, Registers{0x85})->to_string() == "85h");
  CHECK(catalogue::decode(alarm, Registers{6})->to_string() == "06h");
  CHECK(catalogue::decode(alarm, Registers{0})->to_string() == "0");
}
