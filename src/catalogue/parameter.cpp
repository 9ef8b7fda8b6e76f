#include "spindle/catalogue/parameter.hpp"

#include <fmt/format.h>

#include "spindle/base/text.hpp"

namespace spindle::catalogue {

std::vector<std::string> to_strings(const List<Text>& texts) {
  return {texts.begin(), texts.end()};
}

bool share_registers(const Parameter& a, const Parameter& b) {
  const auto end = [](const Parameter& parameter) {
    return parameter.address.value + register_count(parameter.encoding);
  };
  return a.table == b.table && a.address.value < end(b) && b.address.value < end(a);
}

bool share_bits(const Parameter& a, const Parameter& b) {
  const BitSlice& one = a.encoding.slice;
  const BitSlice& other = b.encoding.slice;
  if (!share_registers(a, b)) return false;
  if (one.is_whole() || other.is_whole() || a.address != b.address) return true;
  return one.first < other.first + other.width && other.first < one.first + one.width;
}

Parameter with_bits_for(Parameter parameter, std::optional<std::int64_t> value) {
  std::vector<BitName> counting;
  for (const BitName& name : parameter.bits) {
    if (!name.when || name.when == value) {
      counting.push_back({name.bit, name.text, std::nullopt, name.width});
    }
  }
  parameter.bits = std::move(counting);
  parameter.bits_by = {};
  if (parameter.part.empty()) return parameter;
  for (const BitName& name : parameter.bits) {
    if (!same_ignoring_case(name.text, parameter.part)) continue;
    const std::string whole(parameter.name.view().substr(
        0, parameter.name.view().size() - parameter.part.view().size() - 1));
    parameter.name = whole;
    parameter.part = {};
    return part_of(parameter, name);
  }
  return parameter;
}

Parameter part_of(const Parameter& parameter, const BitName& bit) {
  Parameter part = parameter;
  part.name = fmt::format("{}.{}", parameter.name, bit.text);
  part.title = bit.width == 1 ? fmt::format("{}: bit {}", parameter.title, bit.bit)
                              : fmt::format("{}: bits {} to {}", parameter.title, bit.bit,
                                            bit.bit + bit.width - 1);
  const std::uint16_t registers = register_count(parameter.encoding);
  const auto first = static_cast<std::uint8_t>(parameter.encoding.slice.first + bit.bit);
  part.encoding = {.kind = registers == 1   ? Kind::u16
                           : registers == 2 ? Kind::u32
                                            : Kind::u64,
                   .slice = {first, bit.width},
                   .word_order = parameter.encoding.word_order,
                   .byte_order = parameter.encoding.byte_order};
  part.labels = {};
  part.bits = {};
  part.bits_by = {};
  part.range = {};
  part.except = std::nullopt;
  part.default_value = std::nullopt;
  part.nulls = {};
  return part;
}

Parameter with_power(Parameter parameter, std::int64_t power) {
  Decimal& scale = parameter.encoding.scale;
  scale = Decimal(scale.sign(), scale.magnitude(), scale.exponent() + static_cast<int>(power));
  parameter.scale_by = {};
  return parameter;
}

}  // namespace spindle::catalogue
