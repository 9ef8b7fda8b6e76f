#include "spindle/catalogue/value.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "spindle/base/text.hpp"

namespace spindle::catalogue {
namespace {

constexpr unsigned bits_per_register = 16;

Error fault(Errc code, const Parameter& parameter, std::string message, std::string hint = {}) {
  return {
      .code = code, .message = std::move(message), .hint = std::move(hint), .name = parameter.name};
}

std::int64_t to_integer(Kind kind, RegisterView registers) {
  std::uint32_t word = 0;
  for (const std::uint16_t item : registers) word = (word << bits_per_register) | item;
  switch (kind) {
    case Kind::i16:
      return static_cast<std::int16_t>(word);
    case Kind::i32:
      return static_cast<std::int32_t>(word);
    case Kind::u16:
    case Kind::u32:
      break;
  }
  return word;
}

const Label* label_of(const Parameter& parameter, std::int64_t number) {
  for (const Label& label : parameter.labels) {
    if (label.number == number) return &label;
  }
  return nullptr;
}

char lower(char character) {
  return character >= 'A' && character <= 'Z' ? static_cast<char>(character - 'A' + 'a')
                                              : character;
}

bool same_ignoring_case(std::string_view a, std::string_view b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](char x, char y) { return lower(x) == lower(y); });
}

const Label* label_named(const Parameter& parameter, std::string_view text) {
  for (const Label& label : parameter.labels) {
    if (same_ignoring_case(label.text, text)) return &label;
  }
  return nullptr;
}

std::string list_labels(const Parameter& parameter) {
  std::string list;
  for (const Label& label : parameter.labels) {
    fmt::format_to(std::back_inserter(list), "{}{} ({})", list.empty() ? "" : ", ", label.text,
                   label.number);
  }
  return list;
}

std::string with_suggestion(std::string hint, const std::string& suggested) {
  if (!suggested.empty()) hint += "; " + suggested;
  return hint;
}

Error not_a_label(const Parameter& parameter, std::string_view text) {
  std::vector<std::string> names;
  for (const Label& label : parameter.labels) names.push_back(label.text);
  return fault(
      Errc::bad_value, parameter, fmt::format("'{}' is none of its labels", text),
      with_suggestion(fmt::format("it has {}", list_labels(parameter)), suggestion(text, names)));
}

/// For a user who typed a word, or a comma where a point is meant.
Error not_a_number(const Parameter& parameter, std::string_view text) {
  const bool has_decimals = parameter.encoding.scale.exponent() < 0;
  return fault(Errc::bad_value, parameter, fmt::format("'{}' is not a number", text),
               has_decimals ? "write it in digits with a decimal point, such as 2.5"
                            : "write it in digits without separators, such as 2500");
}

bool is_set(std::int64_t integer, unsigned bit) {
  return ((static_cast<std::uint64_t>(integer) >> bit) & 1U) != 0;
}

/// The names of the bits that are set, the lowest first; those without a name by their number.
std::string bit_names(const Parameter& parameter, std::int64_t integer) {
  std::string names;
  const unsigned bits = register_count(parameter.encoding.kind) * bits_per_register;
  for (unsigned bit = 0; bit < bits; ++bit) {
    if (!is_set(integer, bit)) continue;
    const auto name =
        std::find_if(parameter.bits.begin(), parameter.bits.end(),
                     [bit](const BitName& known) { return known.bit == bit && !known.when; });
    if (!names.empty()) names += ' ';
    names += name == parameter.bits.end() ? fmt::format("bit{}", bit) : name->text.to_string();
  }
  return names;
}

/// What stands beside the number: its label, the names of its bits, or its other notation.
std::string words_for(const Parameter& parameter, std::int64_t integer) {
  if (const Label* label = label_of(parameter, integer)) return label->text;
  if (!parameter.bits.empty()) return bit_names(parameter, integer);
  const bool is_code = parameter.notation == Notation::hexadecimal && integer != 0;
  return is_code ? fmt::format("{:02X}h", integer) : std::string();
}

Error not_a_bit(const Parameter& parameter, std::string_view text) {
  std::vector<std::string> names;
  for (const BitName& name : parameter.bits) names.push_back(name.text);
  return fault(
      Errc::bad_value, parameter, fmt::format("'{}' is none of its bits", text),
      with_suggestion(fmt::format("it has {}", fmt::join(names, ", ")), suggestion(text, names)));
}

/// "M1+FWD" or "M1,FWD" to its number.
Result<Decimal> parse_bits(const Parameter& parameter, std::string_view text) {
  std::string joined(text);
  std::replace(joined.begin(), joined.end(), ',', '+');
  std::int64_t word = 0;
  for (const std::string_view part : split(joined, '+')) {
    const auto name =
        std::find_if(parameter.bits.begin(), parameter.bits.end(),
                     [part](const BitName& known) { return same_ignoring_case(known.text, part); });
    if (name == parameter.bits.end()) return tl::unexpected(not_a_bit(parameter, part));
    word |= std::int64_t{1} << name->bit;
  }
  return Decimal(word);
}

/// Hexadecimal only makes sense for what is stored as it is typed.
std::optional<Decimal> parse_number(const Parameter& parameter, std::string_view text) {
  if (auto number = Decimal::parse(text)) return number;
  if (parameter.encoding.scale != Decimal(1)) return std::nullopt;
  const auto integer =
      parse_unsigned(text, static_cast<std::uint64_t>(highest(parameter.encoding.kind)));
  if (!integer) return std::nullopt;
  return Decimal(static_cast<std::int64_t>(*integer));
}

/// An enumeration without a range of its own has no other values than its labels.
bool closed_enumeration(const Parameter& parameter) {
  return !parameter.labels.empty() && !parameter.range.minimum && !parameter.range.maximum;
}

Result<std::int64_t> to_steps(const Parameter& parameter, const Decimal& number) {
  const Kind kind = parameter.encoding.kind;
  const Decimal& scale = parameter.encoding.scale;
  const auto smallest = Decimal(lowest(kind)).times(scale);
  const auto largest = Decimal(highest(kind)).times(scale);
  if (!smallest || !largest) {
    return tl::unexpected(fault(Errc::internal, parameter, "its scale does not fit its encoding"));
  }
  if (number < *smallest) {
    return tl::unexpected(
        fault(Errc::out_of_range, parameter,
              fmt::format("{} is below {}, the least that {} can hold", number.to_string(),
                          smallest->to_string(), to_text(kind))));
  }
  if (number > *largest) {
    return tl::unexpected(
        fault(Errc::out_of_range, parameter,
              fmt::format("{} is above {}, the most that {} can hold", number.to_string(),
                          largest->to_string(), to_text(kind))));
  }
  const auto steps = number.divided_by(scale);
  if (!steps) {
    return tl::unexpected(
        fault(Errc::bad_value, parameter,
              fmt::format("{} is between two steps of {}", number.to_string(), scale.to_string()),
              fmt::format("round it to a multiple of {}", scale.to_string())));
  }
  return *steps;
}

}  // namespace

Result<Value> decode(const Parameter& parameter, RegisterView registers) {
  const Kind kind = parameter.encoding.kind;
  if (registers.size() != register_count(kind)) {
    return tl::unexpected(fault(
        Errc::internal, parameter,
        fmt::format("{} registers cannot be decoded as {}", registers.size(), to_text(kind))));
  }
  const std::int64_t integer = to_integer(kind, registers);
  const auto number = Decimal(integer).times(parameter.encoding.scale);
  if (!number) {
    return tl::unexpected(fault(Errc::internal, parameter, "its scale does not fit its encoding"));
  }
  return Value{*number, words_for(parameter, integer)};
}

Result<Registers> encode(const Parameter& parameter, const Decimal& number) {
  const auto steps = to_steps(parameter, number);
  if (!steps) return tl::unexpected(steps.error());
  const auto word = static_cast<std::uint32_t>(*steps);
  const auto low = static_cast<std::uint16_t>(word);
  if (register_count(parameter.encoding.kind) == 1) return Registers{low};
  return Registers{static_cast<std::uint16_t>(word >> bits_per_register), low};
}

Result<void> check_range(const Parameter& parameter, const Decimal& number) {
  const Range& range = parameter.range;
  const auto refuse = [&](std::string_view side, const Decimal& limit, std::string_view which) {
    return tl::unexpected(fault(Errc::out_of_range, parameter,
                                fmt::format("{} is {} {}, the {} of the profile",
                                            number.to_string(), side, limit.to_string(), which)));
  };
  if (range.minimum && number < *range.minimum) return refuse("below", *range.minimum, "minimum");
  if (range.maximum && number > *range.maximum) return refuse("above", *range.maximum, "maximum");
  const bool excepted = parameter.except && number >= *parameter.except->minimum &&
                        number <= *parameter.except->maximum;
  if (!excepted) return {};
  return tl::unexpected(fault(
      Errc::out_of_range, parameter,
      fmt::format("{} is between {} and {}, which the profile rules out", number.to_string(),
                  parameter.except->minimum->to_string(), parameter.except->maximum->to_string())));
}

Result<Value> parse_value(const Parameter& parameter, std::string_view text) {
  Decimal number;
  if (const Label* label = label_named(parameter, text)) {
    const auto scaled = Decimal(label->number).times(parameter.encoding.scale);
    number = scaled.value_or(Decimal(label->number));
  } else if (const auto typed = parse_number(parameter, text)) {
    number = *typed;
  } else if (!parameter.bits.empty()) {
    const auto bits = parse_bits(parameter, text);
    if (!bits) return tl::unexpected(bits.error());
    number = *bits;
  } else if (!parameter.labels.empty()) {
    return tl::unexpected(not_a_label(parameter, text));
  } else {
    return tl::unexpected(not_a_number(parameter, text));
  }
  if (auto inside = check_range(parameter, number); !inside) {
    return tl::unexpected(std::move(inside.error()));
  }
  const auto registers = encode(parameter, number);
  if (!registers) return tl::unexpected(registers.error());
  auto value = decode(parameter, *registers);
  if (value && value->label.empty() && closed_enumeration(parameter)) {
    return tl::unexpected(not_a_label(parameter, text));
  }
  return value;
}

}  // namespace spindle::catalogue
