#include "spindle/catalogue/value.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <limits>

#include "codec.hpp"
#include "spindle/base/text.hpp"
#include "spindle/base/utf8.hpp"

namespace spindle::catalogue {
namespace {

Error fault(Errc code, const Parameter& parameter, std::string message, std::string hint = {}) {
  return {
      .code = code, .message = std::move(message), .hint = std::move(hint), .name = parameter.name};
}

/// Numbers of many zeros, as floating-point numbers may be, are shown with an exponent.
std::string readable(const Decimal& number) {
  constexpr int most_zeros = 12;
  const std::string digits = std::to_string(number.magnitude());
  const int place = static_cast<int>(digits.size()) + number.exponent();
  const bool is_small = place <= -most_zeros;
  const bool is_large = number.exponent() >= most_zeros;
  if (number.magnitude() == 0 || !(is_small || is_large)) return number.to_string();
  std::string text = number.sign() == Sign::minus ? "-" : "";
  text += digits.front();
  const std::string_view rest = std::string_view(digits).substr(1, digits.find_last_not_of('0'));
  if (!rest.empty()) text.append(".").append(rest);
  return fmt::format("{}e{}", text, place - 1);
}

const Label* label_of(const Parameter& parameter, std::int64_t number) {
  for (const Label& label : parameter.labels) {
    if (label.number == number) return &label;
  }
  return nullptr;
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
  Error error = fault(
      Errc::bad_value, parameter, fmt::format("'{}' is none of its labels", text),
      with_suggestion(fmt::format("it has {}", list_labels(parameter)), suggestion(text, names)));
  error.remedy = remedy_for(text, names);
  return error;
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

/// The number that some bits are.
std::uint64_t part_of(std::int64_t integer, const BitName& bits) {
  const std::uint64_t mask = (std::uint64_t{1} << bits.width) - 1;
  return (static_cast<std::uint64_t>(integer) >> bits.bit) & mask;
}

void append(std::string& names, const std::string& name) {
  if (!names.empty()) names += ' ';
  names += name;
}

/// The names of the bits that are set, the lowest first; those without a name by their number. Bits
/// that are one number are shown as such, whatever it is.
std::string bit_names(const Parameter& parameter, std::int64_t integer) {
  std::string names;
  constexpr unsigned most = 64;
  constexpr unsigned bits_per_register = 16;
  const unsigned bits = std::min(most, register_count(parameter.encoding) * bits_per_register);
  for (unsigned bit = 0; bit < bits; ++bit) {
    const auto name =
        std::find_if(parameter.bits.begin(), parameter.bits.end(), [bit](const BitName& known) {
          return known.bit <= bit && bit < unsigned{known.bit} + known.width && !known.when;
        });
    if (name != parameter.bits.end() && name->width > 1) {
      append(names, fmt::format("{}={}", name->text, part_of(integer, *name)));
      bit = unsigned{name->bit} + name->width - 1;
    } else if (is_set(integer, bit)) {
      append(names,
             name == parameter.bits.end() ? fmt::format("bit{}", bit) : name->text.to_string());
    }
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

/// "M1+FWD", "M1,FWD" or "M1 FWD" to its number; bits that are one number as "mode=5".
Result<Decimal> parse_bits(const Parameter& parameter, std::string_view text) {
  std::string joined(text);
  std::replace(joined.begin(), joined.end(), ',', '+');
  std::replace(joined.begin(), joined.end(), ' ', '+');
  std::int64_t word = 0;
  for (const std::string_view part : split(joined, '+')) {
    const std::size_t equals = part.find('=');
    const auto name =
        std::find_if(parameter.bits.begin(), parameter.bits.end(), [&](const BitName& known) {
          return same_ignoring_case(known.text, part.substr(0, equals));
        });
    if (name == parameter.bits.end()) return tl::unexpected(not_a_bit(parameter, part));
    const std::uint64_t most = (std::uint64_t{1} << name->width) - 1;
    const auto number = equals == std::string_view::npos
                            ? std::optional(std::uint64_t{1})
                            : parse_unsigned(part.substr(equals + 1), most);
    if (!number) {
      return tl::unexpected(fault(Errc::bad_value, parameter,
                                  fmt::format("'{}' is not a number up to {}", part, most)));
    }
    word |= static_cast<std::int64_t>(*number << name->bit);
  }
  return Decimal(word);
}

/// Whether what is stored is what is typed.
bool has_plain_scale(const Encoding& encoding) {
  return encoding.scale == Decimal(1) && encoding.divisor == 1 && encoding.offset == Decimal(0);
}

/// Hexadecimal only makes sense for what is stored as it is typed.
std::optional<Decimal> parse_number(const Parameter& parameter, std::string_view text) {
  if (auto number = Decimal::parse(text)) return number;
  if (!parameter.encoding.is_integer() || !has_plain_scale(parameter.encoding)) return std::nullopt;
  const auto integer = parse_unsigned(text, highest(parameter.encoding).magnitude());
  if (!integer) return std::nullopt;
  return Decimal(Sign::plus, *integer, 0);
}

/// An enumeration without a range of its own has no other values than its labels.
bool closed_enumeration(const Parameter& parameter) {
  return !parameter.labels.empty() && !parameter.range.minimum && !parameter.range.maximum;
}

/// Of a number that has no exact value with this scale and offset, as far as 64 bits go.
Error too_many_digits(const Parameter& parameter, const Decimal& number) {
  return fault(Errc::bad_value, parameter,
               fmt::format("{} with scale {} and offset {} has too many digits to be exact",
                           readable(number), step_in_words(parameter.encoding),
                           readable(parameter.encoding.offset)));
}

Error not_known_which(const Parameter& parameter) {
  return fault(Errc::usage, parameter,
               fmt::format("which bit it is depends on {}", parameter.bits_by));
}

Error beyond(const Parameter& parameter, const Decimal& number, std::string_view side,
             const std::string& limit, std::string_view which) {
  return fault(Errc::out_of_range, parameter,
               fmt::format("{} is {} {}, the {} that {} can hold", number.to_string(), side, limit,
                           which, to_text(parameter.encoding.kind)));
}

// ---- numbers ----

Value none(std::string why) { return {.label = std::move(why), .content = Content::none}; }

/// Of a floating-point number it is the pattern, or the number itself.
bool is_null(const Parameter& parameter, std::uint64_t pattern) {
  const Kind kind = parameter.encoding.kind;
  const auto number = parameter.encoding.is_float() && !parameter.nulls.empty()
                          ? float_of(kind, pattern).number
                          : std::nullopt;
  return std::any_of(parameter.nulls.begin(), parameter.nulls.end(), [&](std::uint64_t null) {
    return null == pattern || (number && *number == Decimal(static_cast<std::int64_t>(null)));
  });
}

/// The bits that are the value's.
std::uint64_t masked(const Encoding& encoding, std::uint64_t pattern) {
  return encoding.is_float() ? pattern : to_pattern(encoding, to_integer(encoding, pattern));
}

std::int64_t plain(const Integer& integer) {
  return Decimal(integer.sign, integer.magnitude, 0).mantissa();
}

Result<Value> decode_float(const Parameter& parameter, std::uint64_t pattern) {
  auto [number, word] = float_of(parameter.encoding.kind, pattern);
  if (!number) return none(std::move(word));
  const auto value = scaled(parameter.encoding, *number);
  if (!value) return tl::unexpected(too_many_digits(parameter, *number));
  return Value{.number = *value, .decimals = parameter.encoding.decimals};
}

Result<Integer> stored_integer(const Parameter& parameter, std::uint64_t pattern) {
  const Encoding& encoding = parameter.encoding;
  if (encoding.kind != Kind::bcd) return to_integer(encoding, pattern);
  const auto digits = bcd_number(pattern);
  if (digits) return Integer{Sign::plus, *digits};
  return tl::unexpected(
      fault(Errc::bad_value, parameter, fmt::format("{:X} are no decimal digits", pattern)));
}

/// A fraction leaves more decimals than tell its steps apart.
std::optional<std::uint8_t> shown_decimals(const Encoding& encoding) {
  if (encoding.decimals || encoding.divisor == 1) return encoding.decimals;
  std::uint8_t decimals = 0;
  Decimal step = encoding.scale;
  const Decimal divisor(Sign::plus, encoding.divisor, 0);
  while (step < divisor && decimals < std::numeric_limits<std::int8_t>::max()) {
    step = Decimal(step.sign(), step.magnitude(), step.exponent() + 1);
    ++decimals;
  }
  return decimals;
}

Result<Value> decode_number(const Parameter& parameter, RegisterView registers) {
  const Encoding& encoding = parameter.encoding;
  const std::uint64_t pattern = to_pattern(encoding, registers);
  if (is_null(parameter, masked(encoding, pattern))) {
    const bool has_label = encoding.is_integer() && encoding.kind != Kind::bcd;
    const Label* label =
        has_label ? label_of(parameter, plain(to_integer(encoding, pattern))) : nullptr;
    return none(label == nullptr ? std::string() : label->text.to_string());
  }
  if (encoding.is_float()) return decode_float(parameter, pattern);
  TRY_LET(const auto integer, stored_integer(parameter, pattern));
  const Decimal stored(integer.sign, integer.magnitude, 0);
  const auto number = scaled(encoding, stored);
  if (!number) return tl::unexpected(too_many_digits(parameter, stored));
  return Value{.number = *number,
               .label = words_for(parameter, plain(integer)),
               .decimals = shown_decimals(encoding)};
}

Result<Registers> encode_float(const Parameter& parameter, const Decimal& number) {
  const Encoding& encoding = parameter.encoding;
  const auto stored = has_plain_scale(encoding) ? number : unscaled(encoding, number);
  if (!stored) return tl::unexpected(too_many_digits(parameter, number));
  if (const auto pattern = float_pattern(encoding.kind, *stored)) {
    return to_registers(encoding, *pattern);
  }
  return tl::unexpected(fault(
      Errc::out_of_range, parameter,
      fmt::format("{} is more than {} can hold", number.to_string(), to_text(encoding.kind))));
}

Result<Integer> integer_for(const Parameter& parameter, const Decimal& number) {
  const Encoding& encoding = parameter.encoding;
  auto smallest = scaled(encoding, lowest(encoding));
  auto largest = scaled(encoding, highest(encoding));
  if (encoding.scale.sign() == Sign::minus) std::swap(smallest, largest);
  if (smallest && number < *smallest) {
    return tl::unexpected(beyond(parameter, number, "below", smallest->to_string(), "least"));
  }
  if (largest && number > *largest) {
    return tl::unexpected(beyond(parameter, number, "above", largest->to_string(), "most"));
  }
  const auto step = nearest_step(encoding, number);
  const auto stored = step ? std::optional(Decimal(step->sign, step->magnitude, 0)) : std::nullopt;
  if (!stored || *stored < lowest(encoding) || *stored > highest(encoding)) {
    return tl::unexpected(too_many_digits(parameter, number));
  }
  return *step;
}

/// What would be written as 0.
Error too_small(const Parameter& parameter, const Decimal& typed) {
  return fault(Errc::bad_value, parameter,
               fmt::format("{} is less than half a step of {}, so it would be 0", typed.to_string(),
                           step_in_words(parameter.encoding)),
               "write 0 where that is meant; else check the unit");
}

Error between_steps(const Parameter& parameter, const Decimal& number) {
  const std::string step = step_in_words(parameter.encoding);
  return fault(Errc::bad_value, parameter,
               fmt::format("{} is between two steps of {}", number.to_string(), step),
               fmt::format("round it to a multiple of {}", step));
}

/// Of a value that is stored exactly, or not at all.
Result<Registers> encode_number(const Parameter& parameter, const Decimal& number,
                                RegisterView present) {
  const Encoding& encoding = parameter.encoding;
  if (encoding.is_float()) return encode_float(parameter, number);
  TRY_LET(const auto integer, integer_for(parameter, number));
  if (scaled(encoding, Decimal(integer.sign, integer.magnitude, 0)) != number) {
    return tl::unexpected(between_steps(parameter, number));
  }
  if (encoding.is_part() && present.size() != register_count(encoding)) {
    return tl::unexpected(
        fault(Errc::internal, parameter, "it is part of a register that was not read before"));
  }
  const std::uint64_t pattern =
      encoding.kind == Kind::bcd ? bcd_pattern(integer.magnitude) : to_pattern(encoding, integer);
  return to_registers(encoding, pattern, encoding.is_part() ? to_pattern(encoding, present) : 0);
}

/// The number that is stored when this one is typed.
Result<Decimal> nearest(const Parameter& parameter, const Decimal& number) {
  const Encoding& encoding = parameter.encoding;
  if (!encoding.is_float()) {
    TRY_LET(const auto integer, integer_for(parameter, number));
    const Decimal stored(integer.sign, integer.magnitude, 0);
    const auto shown = scaled(encoding, stored);
    if (!shown) return tl::unexpected(too_many_digits(parameter, stored));
    return *shown;
  }
  TRY_LET(const auto registers, encode_float(parameter, number));
  TRY_LET(const auto value, decode_float(parameter, to_pattern(encoding, registers)));
  return value.number;
}

// ---- texts, dates, lists ----

Parameter element_of(const Parameter& parameter) {
  Parameter element = parameter;
  element.encoding.count = 1;
  return element;
}

Result<Value> decode_date(const Parameter& parameter, RegisterView registers) {
  auto date = date_of(parameter.encoding, registers);
  if (!date) {
    return tl::unexpected(
        fault(Errc::bad_value, parameter, fmt::format("{} is no date", fmt::join(registers, " "))));
  }
  if (date->empty()) return none({});
  return Value{.content = Content::text, .text = std::move(*date)};
}

Result<Value> decode_list(const Parameter& parameter, RegisterView registers) {
  const Parameter element = element_of(parameter);
  const std::size_t size = register_count(element.encoding);
  Value list{.content = Content::list};
  for (std::size_t at = 0; at < registers.size(); at += size) {
    auto value = decode(element, registers.subspan(at, size));
    if (!value) return value;
    list.elements.push_back(std::move(*value));
  }
  return list;
}

Result<Registers> encode_list(const Parameter& parameter, const Value& value,
                              RegisterView present) {
  const Parameter element = element_of(parameter);
  const std::size_t size = register_count(element.encoding);
  if (value.elements.size() != parameter.encoding.count) {
    return tl::unexpected(fault(
        Errc::bad_value, parameter,
        fmt::format("it has {} values, not {}", parameter.encoding.count, value.elements.size())));
  }
  Registers all;
  for (const Value& one : value.elements) {
    const RegisterView own = present.empty() ? present : present.subspan(all.size(), size);
    const auto registers = encode(element, one, own);
    if (!registers) return registers;
    all.insert(all.end(), registers->begin(), registers->end());
  }
  return all;
}

Result<Registers> encode_text(const Parameter& parameter, const Value& value) {
  const Encoding& encoding = parameter.encoding;
  if (encoding.kind == Kind::date) {
    if (auto registers = date_registers(encoding, value.text)) return std::move(*registers);
    return tl::unexpected(fault(Errc::bad_value, parameter,
                                fmt::format("'{}' is no date that it can hold", value.text),
                                "write it as 2026-11-22 10:15:30"));
  }
  if (auto registers = text_registers(encoding, value.text)) return std::move(*registers);
  return tl::unexpected(fault(Errc::out_of_range, parameter,
                              fmt::format("'{}' has {} bytes, and {} fit", value.text,
                                          value.text.size(), encoding.length)));
}

Result<Value> parse_list(const Parameter& parameter, std::string_view text) {
  const Parameter element = element_of(parameter);
  Value list{.content = Content::list};
  for (const std::string_view part : split(text, ',')) {
    auto value = parse_value(element, part);
    if (!value) return value;
    list.elements.push_back(std::move(*value));
  }
  const auto fits = encode_list(parameter, list, Registers(register_count(parameter.encoding)));
  if (!fits) return tl::unexpected(fits.error());
  return list;
}

Result<Value> parse_text(const Parameter& parameter, std::string_view text) {
  const Value typed{.content = Content::text, .text = std::string(text)};
  TRY_LET(const auto registers, encode_text(parameter, typed));
  return decode(parameter, registers);
}

/// Whether all texts of a value are such.
bool is_text(const Value& value) {
  return is_utf8(value.text) && std::all_of(value.elements.begin(), value.elements.end(), is_text);
}

std::string_view what_it_is_not(const Encoding& encoding) {
  switch (encoding.kind) {
    case Kind::date:
      return "not a date";
    case Kind::bcd:
      return "no decimal digits";
    case Kind::text:
      return "not UTF-8";
    default:
      return "too many digits to be exact";
  }
}

bool means_no_number(std::string_view text) {
  if (text.starts_with('-') || text.starts_with('+')) text.remove_prefix(1);
  return same_ignoring_case(text, "nan") || same_ignoring_case(text, "inf") ||
         same_ignoring_case(text, "infinity");
}

/// What is typed for a number: itself, a label, or names of bits.
Result<Decimal> typed_number(const Parameter& parameter, std::string_view text) {
  if (const Label* label = label_named(parameter, text)) {
    return scaled(parameter.encoding, Decimal(label->number)).value_or(Decimal(label->number));
  }
  if (const auto typed = parse_number(parameter, text)) return *typed;
  if (parameter.encoding.is_float()) {
    if (const auto typed = parse_scientific(text)) return *typed;
  }
  if (parameter.encoding.is_float() && means_no_number(text)) {
    return tl::unexpected(
        fault(Errc::bad_value, parameter, fmt::format("'{}' is never written", text)));
  }
  if (!parameter.bits.empty()) return parse_bits(parameter, text);
  return tl::unexpected(parameter.labels.empty() ? not_a_number(parameter, text)
                                                 : not_a_label(parameter, text));
}

}  // namespace

std::string Value::to_string() const {
  if (!label.empty()) return label;
  switch (content) {
    case Content::number:
      return readable(shown_number());
    case Content::text:
      return text;
    case Content::list: {
      std::vector<std::string> words;
      for (const Value& one : elements) words.push_back(one.to_string());
      return fmt::format("{}", fmt::join(words, ","));
    }
    case Content::none:
    case Content::raw:
      break;
  }
  return "-";
}

std::string Value::exact() const {
  if (content == Content::number) return number.to_string();
  if (content != Content::list) return to_string();
  std::vector<std::string> words;
  for (const Value& one : elements) words.push_back(one.exact());
  return fmt::format("{}", fmt::join(words, ","));
}

bool Value::is_rounded() const {
  return typed || std::any_of(elements.begin(), elements.end(),
                              [](const Value& element) { return element.is_rounded(); });
}

bool operator==(const Value& a, const Value& b) {
  // Those of another length are of a part of it, such as its low half.
  const bool knows_registers = !a.held.empty() && a.held.size() == b.held.size();
  if (a.content == Content::raw || b.content == Content::raw) {
    return knows_registers && a.held == b.held;
  }
  if (a.content != b.content) return false;
  switch (a.content) {
    case Content::number:
      return a.number == b.number && (!knows_registers || a.held == b.held);
    case Content::text:
      return a.text == b.text;
    case Content::list:
      return a.elements == b.elements;
    case Content::none:
    case Content::raw:
      break;
  }
  return a.label == b.label;
}

Result<Value> decode(const Parameter& parameter, RegisterView registers) {
  const Encoding& encoding = parameter.encoding;
  if (!parameter.part.empty()) return tl::unexpected(not_known_which(parameter));
  if (registers.size() != register_count(encoding)) {
    return tl::unexpected(fault(Errc::internal, parameter,
                                fmt::format("{} registers cannot be decoded as {}",
                                            registers.size(), to_text(encoding.kind))));
  }
  if (encoding.count > 1) return decode_list(parameter, registers);
  if (encoding.kind == Kind::text) {
    return Value{.content = Content::text,
                 .text = text_of(encoding, registers),
                 .held = Registers(registers.begin(), registers.end())};
  }
  auto value = encoding.kind == Kind::date ? decode_date(parameter, registers)
                                           : decode_number(parameter, registers);
  if (value && !encoding.is_part()) value->held.assign(registers.begin(), registers.end());
  return value;
}

Result<Value> decode_or_raw(const Parameter& parameter, RegisterView registers) {
  auto value = decode(parameter, registers);
  if (value ? is_text(*value) : value.error().code != Errc::bad_value) return value;
  return Value{.label = fmt::format("{}: {:04X}", what_it_is_not(parameter.encoding),
                                    fmt::join(registers, " ")),
               .content = Content::raw,
               .held = Registers(registers.begin(), registers.end())};
}

std::optional<std::int64_t> power_of(const Value& value) {
  constexpr std::int64_t most = 30;
  if (!value.is_number() || value.number.exponent() != 0) return std::nullopt;
  const Decimal limit(most);
  if (value.number > limit || value.number < limit.negated()) return std::nullopt;
  return value.number.mantissa();
}

Result<Registers> encode(const Parameter& parameter, const Value& value, RegisterView present) {
  if (!parameter.part.empty()) return tl::unexpected(not_known_which(parameter));
  const bool is_whole = value.held.size() == register_count(parameter.encoding);
  if (is_whole && !parameter.encoding.is_part()) return value.held;
  switch (value.content) {
    case Content::number:
      return encode_number(parameter, value.number, present);
    case Content::text:
      return encode_text(parameter, value);
    case Content::list:
      return encode_list(parameter, value, present);
    case Content::none:
    case Content::raw:
      break;
  }
  return tl::unexpected(
      fault(Errc::bad_value, parameter, fmt::format("'{}' is never written", value.to_string())));
}

Result<void> check_range(const Parameter& parameter, const Value& value) {
  for (const Value& element : value.elements) {
    TRY(check_range(parameter, element));
  }
  if (!value.is_number()) return {};
  const Decimal& number = value.number;
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

std::string rounding_in_words(const Parameter& parameter, const Value& value) {
  std::vector<std::string> parts;
  for (const Value& element : value.elements) {
    if (element.typed) parts.push_back(rounding_in_words(parameter, element));
  }
  if (!parts.empty()) return fmt::format("{}", fmt::join(parts, "; "));
  if (!value.typed) return {};
  const std::string steps = parameter.encoding.is_float()
                                ? fmt::format("not a value of {}", to_text(parameter.encoding.kind))
                                : "between two steps of " + step_in_words(parameter.encoding);
  return fmt::format("{} is {}, so it is {}", value.typed->to_string(), steps, value.exact());
}

Result<Value> parse_value(const Parameter& parameter, std::string_view text) {
  const Encoding& encoding = parameter.encoding;
  if (encoding.count > 1) return parse_list(parameter, text);
  if (encoding.kind == Kind::text || encoding.kind == Kind::date) {
    return parse_text(parameter, text);
  }
  TRY_LET(const auto typed, typed_number(parameter, text));
  TRY(check_range(parameter, {typed}));
  TRY_LET(const auto number, nearest(parameter, typed));
  const Registers nothing(register_count(encoding));
  auto value = encode(parameter, {number}, nothing).and_then([&](const Registers& registers) {
    return decode(parameter, registers);
  });
  if (!value) return value;
  if (!value->is_number()) {
    return tl::unexpected(fault(Errc::bad_value, parameter,
                                fmt::format("{} is how it says that it has no value", text)));
  }
  if (value->label.empty() && closed_enumeration(parameter)) {
    return tl::unexpected(not_a_label(parameter, text));
  }
  TRY(check_range(parameter, *value));
  if (number == typed) return value;
  // Most often the unit is a wrong one.
  if (number == Decimal(0)) return tl::unexpected(too_small(parameter, typed));
  // A label, or the name of a bit, has no neighbours.
  if (closed_enumeration(parameter) || !parameter.bits.empty()) {
    return tl::unexpected(between_steps(parameter, typed));
  }
  value->typed = typed;
  return value;
}

std::string shown_of(const Parameter& parameter, const Value& value) {
  return parameter.secrecy == Secrecy::secret ? "(secret)" : value.to_string();
}

Result<Value> parse_exact_value(const Parameter& parameter, std::string_view text) {
  auto value = parse_value(parameter, text);
  if (!value) return value;
  if (value->typed) return tl::unexpected(between_steps(parameter, *value->typed));
  for (const Value& element : value->elements) {
    if (element.typed) return tl::unexpected(between_steps(parameter, *element.typed));
  }
  return value;
}

}  // namespace spindle::catalogue
