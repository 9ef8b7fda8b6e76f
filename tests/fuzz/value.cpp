// Any text as a value, any registers as a reading, any text as a number or a duration. First byte:
// bits 0 and 1 the kind, bits 2 and 3 the decimals, bit 4 labels, bit 5 a range.

#include "spindle/catalogue/value.hpp"

#include "input.hpp"
#include "spindle/base/duration.hpp"

using namespace spindle;
using namespace spindle::catalogue;
using spindle::fuzz::require;

namespace {

Parameter parameter_of(std::uint8_t choice) {
  Parameter parameter;
  parameter.name = "fuzzed";
  parameter.encoding.kind = static_cast<Kind>(choice & 3U);
  parameter.encoding.scale = Decimal(1, -static_cast<int>((choice >> 2U) & 3U));
  if ((choice & 16U) != 0) {
    parameter.encoding.scale = Decimal(1);
    parameter.labels = {{0, "off"}, {1, "on"}, {7, "TC/AM"}};
  }
  if ((choice & 32U) != 0) parameter.range = {Decimal(-5), Decimal(1000)};
  return parameter;
}

/// One of the encodings that have more than a kind and a scale; the parameter as it is for most
/// bytes.
Parameter with_encoding(Parameter parameter, std::uint8_t choice) {
  Encoding& encoding = parameter.encoding;
  if (choice < 128) return parameter;
  parameter.labels = {};
  encoding = {};
  if ((choice & 1U) != 0) encoding.word_order = WordOrder::little;
  if ((choice & 2U) != 0) encoding.byte_order = ByteOrder::little;
  switch ((choice >> 2U) % 9) {
    case 0:
      encoding.kind = Kind::f32;
      break;
    case 1:
      encoding.kind = Kind::f64;
      break;
    case 2:
      encoding.kind = Kind::u64;
      break;
    case 3:
      encoding.kind = Kind::i64;
      encoding.scale = Decimal(1, -3);
      break;
    case 4:
      encoding.kind = Kind::bcd;
      encoding.length = 4;
      break;
    case 5:
      encoding.kind = Kind::text;
      encoding.length = 5;
      break;
    case 6:
      encoding.kind = Kind::u16;
      encoding.scale = Decimal(20);
      encoding.divisor = 32768;
      break;
    case 7:
      encoding.kind = Kind::i8;
      encoding.slice = {8, 8};
      break;
    default:
      encoding.kind = Kind::date;
      break;
  }
  return parameter;
}

/// What a user may write reads back as what was written.
void check_text(const Parameter& parameter, const std::string& text) {
  const auto value = parse_value(parameter, text);
  if (!value) {
    require(value.error().status() == ExitStatus::usage);
    return;
  }
  const auto registers = encode(parameter, *value, Registers(register_count(parameter.encoding)));
  require(registers.has_value());
  const auto back = decode(parameter, *registers);
  require(back && *back == *value && back->label == value->label);
  require(check_range(parameter, *value).has_value());
}

/// What a tool holds encodes to what it holds.
void check_registers(const Parameter& parameter, const Registers& registers) {
  const auto value = decode(parameter, registers);
  const Encoding& encoding = parameter.encoding;
  if (!value) {
    // Digits above 9, and days that are none.
    require(encoding.kind == Kind::bcd || encoding.kind == Kind::date);
    return;
  }
  if (!value->is_number()) return;
  const auto again = encode(parameter, *value, registers);
  const bool is_minus_zero = encoding.is_float() && value->number == Decimal(0);
  require(is_minus_zero || again == registers);
  const auto number = Decimal::parse(value->number.to_string());
  require(number && *number == value->number);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Input input(data, size);
  const Parameter plain = parameter_of(input.byte());
  const Parameter parameter = with_encoding(plain, input.byte());
  check_text(parameter, input.text());
  if (const auto number = Decimal::parse(input.text())) {
    require(Decimal::parse(number->to_string()) == *number);
  }
  if (const auto duration = parse_duration(input.text())) {
    require(parse_duration(to_text(*duration)) == *duration);
  }
  Registers registers;
  for (unsigned word = 0; word < register_count(parameter.encoding); ++word) {
    registers.push_back(input.word());
  }
  check_registers(parameter, registers);
  return 0;
}
