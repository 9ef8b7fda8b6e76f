#include "spindle/catalogue/encoding.hpp"

#include <doctest/doctest.h>

#include <bit>
#include <limits>
#include <random>

#include "spindle/catalogue/value.hpp"

using namespace spindle;
using namespace spindle::catalogue;

namespace {

Parameter with(Encoding encoding) {
  Parameter parameter;
  parameter.name = "x";
  parameter.encoding = encoding;
  return parameter;
}

Decimal number(std::string_view text) { return *Decimal::parse(text); }

std::string shown(const Encoding& encoding, const Registers& registers) {
  const auto value = decode(with(encoding), registers);
  return value ? value->to_string() : message_of(value.error());
}

/// The registers of what is typed; empty where it is refused.
Registers typed(const Encoding& encoding, std::string_view text, const Registers& present = {}) {
  return parse_value(with(encoding), text)
      .and_then([&](const Value& value) { return encode(with(encoding), value, present); })
      .value_or(Registers());
}

std::string why(const Parameter& parameter, std::string_view text) {
  const auto value = parse_value(parameter, text);
  return value ? "" : message_of(value.error());
}

}  // namespace

TEST_CASE("integers of every kind, word order and byte order are read and written") {
  struct Case {
    Encoding encoding;
    Registers registers;
    std::string text;
  };
  constexpr auto little = WordOrder::little;
  constexpr auto swapped = ByteOrder::little;
  const std::vector<Case> cases = {
      {{.kind = Kind::u16}, {0xFFFF}, "65535"},
      {{.kind = Kind::i16}, {0x8000}, "-32768"},
      {{.kind = Kind::i16, .byte_order = swapped}, {0x00FF}, "-256"},
      {{.kind = Kind::u32}, {0x1234, 0x5678}, "305419896"},
      {{.kind = Kind::u32, .word_order = little}, {0x5678, 0x1234}, "305419896"},
      {{.kind = Kind::u32, .byte_order = swapped}, {0x3412, 0x7856}, "305419896"},
      {{.kind = Kind::u32, .word_order = little, .byte_order = swapped},
       {0x7856, 0x3412},
       "305419896"},
      {{.kind = Kind::i32, .word_order = little}, {0xFFFE, 0xFFFF}, "-2"},
      {{.kind = Kind::u64}, {0xFFFF, 0xFFFF, 0xFFFF, 0xFFFF}, "18446744073709551615"},
      {{.kind = Kind::i64}, {0x8000, 0, 0, 0}, "-9223372036854775808"},
      {{.kind = Kind::i64, .word_order = little},
       {0xFFFF, 0xFFFF, 0xFFFF, 0x7FFF},
       "9223372036854775807"},
      {{.kind = Kind::u64, .scale = Decimal(1, -3)}, {0, 0, 0, 1500}, "1.500"},
      {{.kind = Kind::bcd, .length = 2}, {0x1234}, "1234"},
      {{.kind = Kind::bcd, .length = 4}, {0x0012, 0x3456}, "123456"},
      {{.kind = Kind::bcd, .length = 4, .word_order = little}, {0x3456, 0x0012}, "123456"},
      {{.kind = Kind::bcd, .scale = Decimal(1, -2), .length = 4}, {0x0012, 0x3456}, "1234.56"},
      {{.kind = Kind::bcd, .length = 8}, {0x9999, 0x9999, 0x9999, 0x9999}, "9999999999999999"},
  };
  for (const Case& row : cases) {
    CAPTURE(row.text);
    CHECK(shown(row.encoding, row.registers) == row.text);
    CHECK(typed(row.encoding, row.text) == row.registers);
  }
  CHECK(shown({.kind = Kind::bcd, .length = 2}, {0x12A4}) == "12A4 are no decimal digits");
  CHECK(typed({.kind = Kind::bcd, .length = 2}, "10000").empty());
  CHECK(typed({.kind = Kind::u64}, "18446744073709551616").empty());
}

TEST_CASE("floating-point numbers keep their bits") {
  CHECK(shown({.kind = Kind::f32}, {0x4048, 0xF5C3}) == "3.14");
  CHECK(typed({.kind = Kind::f32}, "3.14") == Registers{0x4048, 0xF5C3});
  CHECK(typed({.kind = Kind::f32, .word_order = WordOrder::little}, "3.14") ==
        Registers{0xF5C3, 0x4048});
  CHECK(shown({.kind = Kind::f32, .decimals = 1}, {0x4048, 0xF5C3}) == "3.1");
  CHECK(shown({.kind = Kind::f32, .decimals = 3}, {0x4048, 0xF5C3}) == "3.140");
  CHECK(shown({.kind = Kind::f32}, {0x42C8, 0x0000}) == "100");
  CHECK(shown({.kind = Kind::f32}, {0x0000, 0x0001}) == "1e-45");
  CHECK(shown({.kind = Kind::f64}, {0x4009, 0x21FB, 0x5444, 0x2D18}) == "3.141592653589793");
  CHECK(shown({.kind = Kind::f32, .scale = Decimal(1, -3)}, {0x447A, 0x0000}) == "1");
  CHECK(typed({.kind = Kind::f32, .scale = Decimal(1, -3)}, "1") == Registers{0x447A, 0x0000});

  std::mt19937 random(20261129);
  for (int i = 0; i < 20'000; ++i) {
    const auto bits = static_cast<std::uint32_t>(random());
    const Registers registers{static_cast<std::uint16_t>(bits >> 16U),
                              static_cast<std::uint16_t>(bits)};
    const Parameter parameter = with({.kind = Kind::f32});
    const auto value = decode(parameter, registers);
    REQUIRE(value);
    if (!value->is_number()) continue;
    const bool is_minus_zero = bits == 0x8000'0000;
    if (is_minus_zero) continue;
    CAPTURE(bits);
    REQUIRE(*encode(parameter, *value) == registers);
    const auto again = parse_value(parameter, value->exact());
    REQUIRE(again);
    REQUIRE(*again == *value);
    REQUIRE_FALSE(again->typed);
  }
}

TEST_CASE("what is no number is shown as such and never written") {
  for (const auto& [registers, word] :
       {std::pair(Registers{0x7FC0, 0x0000}, "NaN"), std::pair(Registers{0xFFC0, 0x0001}, "NaN"),
        std::pair(Registers{0x7F80, 0x0000}, "inf"),
        std::pair(Registers{0xFF80, 0x0000}, "-inf")}) {
    const Parameter parameter = with({.kind = Kind::f32});
    const auto value = decode(parameter, registers);
    REQUIRE(value);
    CHECK(value->content == Content::none);
    CHECK(value->to_string() == word);
    CHECK(encode(parameter, *value) == registers);  // what stood there is put back as it was
    Value typed = *value;
    typed.held.clear();
    CHECK_FALSE(encode(parameter, typed));
    CHECK(why(parameter, word) == fmt::format("'{}' is never written", word));
  }
  CHECK(why(with({.kind = Kind::f32}), "1" + std::string(39, '0')).find("more than f32") !=
        std::string::npos);
}

TEST_CASE("a number between two steps becomes the nearest one, and says so") {
  const Parameter torque = with({.kind = Kind::u16, .scale = Decimal(1, -2)});
  const auto value = parse_value(torque, "2.715");
  REQUIRE(value);
  CHECK(value->number == number("2.72"));
  CHECK(rounding_in_words(torque, *value) == "2.715 is between two steps of 0.01, so it is 2.72");
  CHECK_FALSE(parse_value(torque, "2.71")->typed);
  CHECK_FALSE(encode(torque, {number("2.715")}));

  const Parameter single = with({.kind = Kind::f32});
  const auto rounded = parse_value(single, "3.14159265358979");
  REQUIRE(rounded);
  CHECK(rounding_in_words(single, *rounded) ==
        "3.14159265358979 is not a value of f32, so it is 3.1415927");
}

TEST_CASE("a scale may be a fraction, and have an offset") {
  const Encoding ampere{.kind = Kind::u16, .scale = Decimal(20), .divisor = 32768};
  CHECK(shown(ampere, {32768}) == "20.0000");
  CHECK(shown(ampere, {1}) == "0.0006");
  CHECK(decode(with(ampere), Registers{1})->number == number("0.0006103515625"));
  CHECK(typed(ampere, "20") == Registers{32768});
  const Parameter parameter = with(ampere);
  const auto value = parse_value(parameter, "4");
  REQUIRE(value);
  CHECK(*encode(parameter, *value) == Registers{6554});
  CHECK(rounding_in_words(parameter, *value) ==
        "4 is between two steps of 20/32768, so it is 4.000244140625");

  const Encoding third{.kind = Kind::u16, .scale = Decimal(1), .divisor = 3};
  for (std::uint16_t word = 0; word < 1000; ++word) {
    const auto one = decode(with(third), Registers{word});
    REQUIRE(one);
    CAPTURE(word);
    REQUIRE(*encode(with(third), *one) == Registers{word});
    REQUIRE(typed(third, one->to_string()) == Registers{word});
  }

  const Encoding celsius{.kind = Kind::u16, .scale = Decimal(1, -1), .offset = Decimal(-40)};
  CHECK(shown(celsius, {0}) == "-40.0");
  CHECK(shown(celsius, {653}) == "25.3");
  CHECK(typed(celsius, "25.3") == Registers{653});
  CHECK(typed(celsius, "-40.1").empty());
}

TEST_CASE("bits and halves of a register are written without the others") {
  const Encoding third_bit{.kind = Kind::bit, .slice = {3, 1}};
  CHECK(shown(third_bit, {0x0008}) == "1");
  CHECK(shown(third_bit, {0xFFF7}) == "0");
  CHECK(typed(third_bit, "1", {0xA550}) == Registers{0xA558});
  CHECK(typed(third_bit, "0", {0xFFFF}) == Registers{0xFFF7});
  CHECK(typed(third_bit, "2", {0}).empty());
  CHECK_FALSE(encode(with(third_bit), {Decimal(1)}));  // what the register holds is not known

  const Encoding mode{.kind = Kind::bit, .slice = {4, 3}};
  CHECK(shown(mode, {0x0050}) == "5");
  CHECK(typed(mode, "7", {0x8001}) == Registers{0x8071});

  const Encoding high{.kind = Kind::i8, .slice = {8, 8}};
  CHECK(shown(high, {0xFE12}) == "-2");
  CHECK(typed(high, "-128", {0x0034}) == Registers{0x8034});
  const Encoding low{.kind = Kind::u8, .slice = {0, 8}};
  CHECK(shown(low, {0xFE12}) == "18");
  CHECK(typed(low, "255", {0xAB00}) == Registers{0xABFF});

  const Encoding wide{.kind = Kind::u32, .slice = {20, 1}, .word_order = WordOrder::little};
  CHECK(typed(wide, "1", {0x0001, 0x0000}) == Registers{0x0001, 0x0010});
}

TEST_CASE("bits have names, and groups of bits are numbers") {
  Parameter control = with({.kind = Kind::u16});
  control.name = "control";
  control.bits = {{0, "start"}, {1, "reverse"}, {4, "mode", std::nullopt, 3}};
  CHECK(decode(control, Registers{0x0051})->label == "start mode=5");
  CHECK(decode(control, Registers{0x0002})->label == "reverse mode=0");
  CHECK(parse_value(control, "start mode=5")->number == Decimal(0x51));
  CHECK(parse_value(control, "mode=7+reverse")->number == Decimal(0x72));
  CHECK(why(control, "mode=8") == "'mode=8' is not a number up to 7");
  const Parameter start = part_of(control, control.bits[0]);
  CHECK(start.name == "control.start");
  CHECK(*encode(start, {Decimal(1)}, Registers{0x0050}) == Registers{0x0051});
  const Parameter mode = part_of(control, control.bits[2]);
  CHECK(*encode(mode, {Decimal(2)}, Registers{0x0051}) == Registers{0x0021});
}

TEST_CASE("texts are cut at their end, filled up, and refused when they are too long") {
  const Encoding text{.kind = Kind::text, .length = 6};
  CHECK(shown(text, {0x4142, 0x4300, 0x5859}) == "ABC");
  CHECK(typed(text, "ABC") == Registers{0x4142, 0x4300, 0x0000});
  CHECK(typed(text, "ABCDEF") == Registers{0x4142, 0x4344, 0x4546});
  CHECK(typed(text, "ABCDEFG").empty());
  const Encoding odd{.kind = Kind::text, .length = 5};
  CHECK(typed(odd, "ABCDE") == Registers{0x4142, 0x4344, 0x4500});
  CHECK(typed(odd, "ABCDEF").empty());
  const Encoding swapped{
      .kind = Kind::text, .length = 4, .byte_order = ByteOrder::little, .padding = Padding::space};
  CHECK(shown(swapped, {0x4241, 0x2043}) == "ABC");
  CHECK(typed(swapped, "ABC") == Registers{0x4241, 0x2043});
  const Encoding low{.kind = Kind::text, .length = 4, .packing = Packing::low};
  CHECK(shown(low, {0x0041, 0x0042, 0, 0}) == "AB");
  CHECK(typed(low, "AB") == Registers{0x0041, 0x0042, 0, 0});
  const Encoding utf{.kind = Kind::text, .length = 4};
  CHECK(shown(utf, {0xC3A4, 0x0000}) == "ä");
}

TEST_CASE("dates are dates, nothing, or an error") {
  const Encoding six{.kind = Kind::date};
  CHECK(shown(six, {26, 11, 22, 10, 15, 30}) == "2026-11-22 10:15:30");
  CHECK(typed(six, "2026-11-22 10:15:30") == Registers{26, 11, 22, 10, 15, 30});
  CHECK(typed(six, "2026-11-22") == Registers{26, 11, 22, 0, 0, 0});
  CHECK(shown(six, {0, 0, 0, 0, 0, 0}) == "-");
  CHECK(shown(six, {26, 13, 1, 0, 0, 0}) == "26 13 1 0 0 0 is no date");
  CHECK(shown(six, {26, 2, 30, 0, 0, 0}) == "26 2 30 0 0 0 is no date");
  CHECK(shown(six, {26, 2, 3, 24, 0, 0}) == "26 2 3 24 0 0 is no date");
  CHECK(typed(six, "2026-02-30").empty());
  CHECK(typed(six, "1999-02-03").empty());
  CHECK(typed({.kind = Kind::date, .date = DateLayout::long_year}, "1999-02-03") ==
        Registers{1999, 2, 3, 0, 0, 0});
  CHECK(shown({.kind = Kind::date, .date = DateLayout::bytes}, {0x1A0B, 0x160A, 0x0F1E}) ==
        "2026-11-22 10:15:30");
  const Encoding unix_time{.kind = Kind::date, .date = DateLayout::unix_time};
  CHECK(typed(unix_time, "2026-11-22 10:15:30") == Registers{0x6B02, 0xC0C2});
  CHECK(shown(unix_time, {0x6B02, 0xC0C2}) == "2026-11-22 10:15:30");
}

TEST_CASE("what means that there is no value is none") {
  Parameter parameter = with({.kind = Kind::i16, .scale = Decimal(1, -1)});
  parameter.nulls = {0x8000, 0x7FFF};
  parameter.labels = {{32767, "not connected"}};
  CHECK(decode(parameter, Registers{0x8000})->content == Content::none);
  CHECK(decode(parameter, Registers{0x8000})->to_string() == "-");
  CHECK(decode(parameter, Registers{0x7FFF})->to_string() == "not connected");
  CHECK(decode(parameter, Registers{0x8001})->number == number("-3276.7"));
  CHECK(why(parameter, "-3276.8") == "-3276.8 is how it says that it has no value");
}

TEST_CASE("several values stand one behind the other") {
  const Encoding three{.kind = Kind::i16, .scale = Decimal(1, -1), .count = 3};
  CHECK(register_count(three) == 3);
  CHECK(shown(three, {1, 0xFFFF, 30}) == "0.1,-0.1,3.0");
  CHECK(typed(three, "0.1,-0.1,3") == Registers{1, 0xFFFF, 30});
  CHECK(typed(three, "0.1,-0.1").empty());
  CHECK(*decode(with(three), Registers{1, 2, 3}) == *decode(with(three), Registers{1, 2, 3}));
  CHECK_FALSE(*decode(with(three), Registers{1, 2, 3}) == *decode(with(three), Registers{1, 2, 4}));
}

TEST_CASE("a power of ten is a small whole number") {
  CHECK(power_of({number("-3")}) == -3);
  CHECK(power_of({number("30")}) == 30);
  CHECK_FALSE(power_of({number("31")}));
  CHECK_FALSE(power_of({number("4294967295")}));
  CHECK_FALSE(power_of({number("-32768")}));
  CHECK_FALSE(power_of({number("1.5")}));
  CHECK_FALSE(power_of({.content = Content::none}));
}

TEST_CASE("every element of a list lies in the range") {
  Parameter list = with({.kind = Kind::i16, .count = 3});
  list.range = {Decimal(0), Decimal(10)};
  CHECK(check_range(list, *decode(list, Registers{1, 2, 10})));
  CHECK_FALSE(check_range(list, *decode(list, Registers{1, 2, 99})));
}

TEST_CASE("a floating-point number that means none, as a number or as its bits") {
  Parameter parameter = with({.kind = Kind::f32});
  parameter.nulls = {static_cast<std::uint64_t>(-999), 0x7F7FFFFF};
  CHECK(decode(parameter, Registers{0xC479, 0xC000})->content == Content::none);
  CHECK(decode(parameter, Registers{0x7F7F, 0xFFFF})->content == Content::none);
  CHECK(decode(parameter, Registers{0x4479, 0xC000})->to_string() == "999");
}

namespace {

std::string hex(const Registers& registers) {
  std::string text;
  for (const std::uint16_t word : registers) text += std::to_string(word) + " ";
  return text;
}

/// Whether registers come back as they were from what they are decoded to.
bool comes_back(const Parameter& parameter, const Registers& registers) {
  const auto value = decode_or_raw(parameter, registers);
  return value && encode(parameter, *value).value_or(Registers()) == registers;
}

}  // namespace

TEST_CASE("whatever stands in registers is put back to the last bit, and tells itself apart") {
  std::mt19937_64 random(20261130);
  const Encoding kinds[] = {
      {.kind = Kind::u64, .scale = Decimal(20), .divisor = 32768},
      {.kind = Kind::u64, .scale = Decimal(20), .divisor = 32768, .offset = Decimal(5, -1)},
      {.kind = Kind::i64, .scale = Decimal(1), .divisor = 3},
      {.kind = Kind::f64, .scale = Decimal(1), .divisor = 3},
      {.kind = Kind::f32, .offset = Decimal(-40)},
      {.kind = Kind::f32, .offset = Decimal(-40), .decimals = 1},
      {.kind = Kind::f64, .offset = Decimal(1, -1)},
      {.kind = Kind::bcd, .length = 4},
      {.kind = Kind::date, .date = DateLayout::bytes},
      {.kind = Kind::text, .length = 6},
      {.kind = Kind::i16, .scale = Decimal(5, -1), .count = 3},
  };
  for (const Encoding& encoding : kinds) {
    const Parameter parameter = with(encoding);
    for (int i = 0; i < 2000; ++i) {
      Registers registers(register_count(encoding));
      for (std::uint16_t& word : registers) word = static_cast<std::uint16_t>(random());
      CAPTURE(to_text(encoding.kind));
      CAPTURE(hex(registers));
      REQUIRE(comes_back(parameter, registers));
      const bool is_pattern = encoding.is_integer() || encoding.is_float();
      if (!is_pattern) continue;
      Registers neighbour = registers;
      neighbour.back() ^= 1U;
      const auto one = decode_or_raw(parameter, registers);
      const auto other = decode_or_raw(parameter, neighbour);
      REQUIRE((one->content == Content::none || !(*one == *other)));
    }
  }
}

TEST_CASE(
    "a number and an offset that have no exact sum are told, and are no fault of the program") {
  const Parameter exact = with({.kind = Kind::f32, .offset = Decimal(-40)});
  const auto tiny = decode(exact, Registers{0x0DA2, 0x4260});
  REQUIRE_FALSE(tiny);
  CHECK(tiny.error().code == Errc::bad_value);
  CHECK(message_of(tiny.error()) ==
        "1e-30 with scale 1 and offset -40 has too many digits to be exact");
  CHECK(decode_or_raw(exact, Registers{0x0DA2, 0x4260})->to_string() ==
        "too many digits to be exact: 0DA2 4260");
  for (const std::string_view text : {"1e38", "1e-38", "123456789012345678901"}) {
    const auto value = parse_value(exact, text);
    REQUIRE_FALSE(value);
    CHECK(value.error().code == Errc::bad_value);
  }
  // Where only some decimals are shown, the others need not be kept: the registers are.
  const Parameter rounded = with({.kind = Kind::f32, .offset = Decimal(-40), .decimals = 1});
  CHECK(decode(rounded, Registers{0x0DA2, 0x4260})->to_string() == "-40.0");

  const Parameter wide =
      with({.kind = Kind::u64, .scale = Decimal(1, -3), .offset = Decimal(1, -5)});
  const auto most = decode(wide, Registers{0xFFFF, 0xFFFF, 0xFFFF, 0xFFFF});
  REQUIRE_FALSE(most);
  CHECK(most.error().code == Errc::bad_value);
  CHECK(parse_value(wide, "0.00101")->number == number("0.00101"));
  CHECK(
      why(wide, "18446744073709551.615") ==
      "18446744073709551.615 with scale 0.001 and offset 0.00001 has too many digits to be exact");
}

TEST_CASE("what is no value of its encoding is raw, and equal to the same registers only") {
  const Parameter clock = with({.kind = Kind::date, .date = DateLayout::bytes});
  const auto broken = decode_or_raw(clock, Registers{0xFFFF, 0xFFFF, 0});
  REQUIRE(broken);
  CHECK(broken->content == Content::raw);
  CHECK(broken->to_string() == "not a date: FFFF FFFF 0000");
  CHECK(*broken == *decode_or_raw(clock, Registers{0xFFFF, 0xFFFF, 0}));
  CHECK_FALSE(*broken == *decode_or_raw(clock, Registers{0xFFFF, 0xFFFF, 1}));
  CHECK_FALSE(*broken == *decode_or_raw(clock, Registers{0x1A0B, 0x160A, 0x0F1E}));
  CHECK(check_range(clock, *broken));
  CHECK(decode_or_raw(with({.kind = Kind::bcd, .length = 2}), Registers{0x12A4})->to_string() ==
        "no decimal digits: 12A4");
  const Parameter text = with({.kind = Kind::text, .length = 4});
  CHECK(decode_or_raw(text, Registers{0x41FF, 0})->to_string() == "not UTF-8: 41FF 0000");
  CHECK(decode_or_raw(text, Registers{0x4142, 0})->to_string() == "AB");
  // As it is typed in another character set.
  CHECK(*parse_value(text, "A\xFF") == *decode_or_raw(text, Registers{0x41FF, 0}));
}

TEST_CASE("what means that there is no value is told apart by its words") {
  const Parameter single = with({.kind = Kind::f32});
  CHECK_FALSE(*decode(single, Registers{0x7FC0, 0}) == *decode(single, Registers{0x7F80, 0}));
  CHECK(*decode(single, Registers{0x7FC0, 0}) == *decode(single, Registers{0x7FC0, 1}));
}

TEST_CASE("every element of a list that is rounded is told, and none is where it is not typed") {
  const Parameter list = with({.kind = Kind::i16, .scale = Decimal(5, -1), .count = 3});
  const auto value = parse_value(list, "1.1,2,3.3");
  REQUIRE(value);
  CHECK(value->is_rounded());
  CHECK(rounding_in_words(list, *value) ==
        "1.1 is between two steps of 0.5, so it is 1.0; 3.3 is between two steps of 0.5, so it is "
        "3.5");
  CHECK_FALSE(parse_value(list, "1,2,3.5")->is_rounded());
  CHECK_FALSE(parse_exact_value(list, "1.1,2,3.3"));
  CHECK(parse_exact_value(list, "1,2,3.5"));
}
