#include "spindle/catalogue/unit.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <limits>
#include <optional>
#include <vector>

#include "codec.hpp"
#include "spindle/base/decimal.hpp"
#include "spindle/base/text.hpp"

namespace spindle::catalogue {
namespace {

__extension__ using Wide = unsigned __int128;

/// A unit with the others of its quantity: so many of `base` units are (number + offset) × factor /
/// divisor.
struct Unit {
  std::string_view quantity;  ///< "a power"
  std::string_view text;
  std::string_view prefixes = {};  ///< SI prefixes that it is known with
  Decimal factor = Decimal(1);
  std::uint32_t divisor = 1;
  Decimal offset = Decimal(0);
};

constexpr std::string_view power = "a power";
constexpr std::string_view apparent = "an apparent power";
constexpr std::string_view reactive = "a reactive power";
constexpr std::string_view energy = "an energy";
constexpr std::string_view charge = "a charge";
constexpr std::string_view torque = "a torque";
constexpr std::string_view force = "a force";
constexpr std::string_view pressure = "a pressure";
constexpr std::string_view speed = "a speed of rotation";
constexpr std::string_view frequency = "a frequency";
constexpr std::string_view duration = "a time";
constexpr std::string_view temperature = "a temperature";
constexpr std::string_view voltage = "a voltage";
constexpr std::string_view current = "a current";
constexpr std::string_view resistance = "a resistance";
constexpr std::string_view length = "a length";
constexpr std::string_view mass = "a mass";
constexpr std::string_view angle = "an angle";
constexpr std::string_view radians = "an angle in radians";
constexpr std::string_view percent = "a percentage";

/// By definition: kgf = 9.80665 N, lb = 0.45359237 kg, inch = 0.0254 m, foot = 12 inches,
/// pound = 16 ounces.
constexpr Unit units[] = {
    {power, "W", "umkMG"},
    {apparent, "VA", "mkMG"},
    {reactive, "var", "mkMG"},
    {energy, "J", "mkMG"},
    {energy, "Ws", "mkMG"},
    {energy, "Wh", "mkMG", Decimal(3600)},
    {charge, "Ah", "mk"},
    {torque, "N.m", "umckM"},
    {torque, "N.cm", "", Decimal(1, -2)},
    {torque, "N.mm", "", Decimal(1, -3)},
    {torque, "kgf.m", "", Decimal(980665, -5)},
    {torque, "kgf.cm", "", Decimal(980665, -7)},
    {torque, "gf.cm", "", Decimal(980665, -10)},
    {torque, "lbf.ft", "", Decimal(13558179483314004, -16)},
    {torque, "lbf.in", "", Decimal(1129848290276167, -16)},
    {torque, "ozf.in", "", Decimal(706155181422604375, -20)},
    {force, "N", "umkM"},
    {force, "kgf", "", Decimal(980665, -5)},
    {force, "gf", "", Decimal(980665, -8)},
    {force, "lbf", "", Decimal(44482216152605, -13)},
    {force, "ozf", "", Decimal(2780138509537812500, -19)},
    {pressure, "Pa", "mhkM"},
    {pressure, "bar", "m", Decimal(100000)},
    {pressure, "psi", "", Decimal(44482216152605, -5), 64516},
    {speed, "rpm"},
    {speed, "r/min"},
    {speed, "rev/min"},
    {speed, "1/min"},
    {speed, "min-1"},
    {speed, "r/s", "", Decimal(60)},
    {speed, "rev/s", "", Decimal(60)},
    {speed, "rps", "", Decimal(60)},
    {frequency, "Hz", "mkMG"},
    {duration, "s", "num"},
    {duration, "min", "", Decimal(60)},
    {duration, "h", "", Decimal(3600)},
    {temperature, "K", "m"},
    {temperature, "degC", "", Decimal(1), 1, Decimal(27315, -2)},
    {temperature, "°C", "", Decimal(1), 1, Decimal(27315, -2)},
    {temperature, "degF", "", Decimal(5), 9, Decimal(45967, -2)},
    {temperature, "°F", "", Decimal(5), 9, Decimal(45967, -2)},
    {voltage, "V", "umkM"},
    {current, "A", "umk"},
    {resistance, "Ohm", "mkM"},
    {resistance, "Ω", "mkM"},
    {length, "m", "numck"},
    {length, "in", "", Decimal(254, -4)},
    {length, "ft", "", Decimal(3048, -4)},
    {mass, "g", "umk"},
    {mass, "t", "", Decimal(1000000)},
    {mass, "lb", "", Decimal(45359237, -5)},
    {mass, "oz", "", Decimal(28349523125, -9)},
    {angle, "deg"},
    {angle, "°"},
    {radians, "rad", "m"},
    {percent, "%"},
};

struct Prefix {
  std::string_view text;
  char letter;
  int exponent;
};
constexpr Prefix prefixes[] = {{"n", 'n', -9}, {"u", 'u', -6}, {"µ", 'u', -6}, {"μ", 'u', -6},
                               {"m", 'm', -3}, {"c", 'c', -2}, {"h", 'h', 2},  {"k", 'k', 3},
                               {"M", 'M', 6},  {"G", 'G', 9}};

/// Other ways to write the same: "Nm", "N·m", "in-lb".
struct Spelling {
  std::string_view written;
  std::string_view meant;
};
constexpr Spelling spellings[] = {
    {"Nm", "N.m"},       {"Ncm", "N.cm"},     {"Nmm", "N.mm"},     {"kgfm", "kgf.m"},
    {"kgfcm", "kgf.cm"}, {"kg.m", "kgf.m"},   {"kg.cm", "kgf.cm"}, {"gfcm", "gf.cm"},
    {"lbfft", "lbf.ft"}, {"lb.ft", "lbf.ft"}, {"ft.lb", "lbf.ft"}, {"ft.lbf", "lbf.ft"},
    {"lbfin", "lbf.in"}, {"lb.in", "lbf.in"}, {"in.lb", "lbf.in"}, {"in.lbf", "lbf.in"},
    {"ozfin", "ozf.in"}, {"oz.in", "ozf.in"}, {"in.oz", "ozf.in"}, {"in.ozf", "ozf.in"},
    {"ohm", "Ohm"},      {"sec", "s"},
};

/// With one sign for products.
std::string with_points(std::string_view text) {
  std::string pointed(text);
  for (const std::string_view sign : {"·", "⋅", "*"}) {
    for (std::size_t at = pointed.find(sign); at != std::string::npos; at = pointed.find(sign)) {
      pointed.replace(at, sign.size(), ".");
    }
  }
  if (pointed != "min-1") std::replace(pointed.begin(), pointed.end(), '-', '.');
  return pointed;
}

std::optional<Unit> find_exactly(std::string_view text) {
  for (const Unit& unit : units) {
    if (unit.text == text) return unit;
    if (!text.ends_with(unit.text)) continue;
    const std::string_view before = text.substr(0, text.size() - unit.text.size());
    for (const Prefix& prefix : prefixes) {
      if (prefix.text != before || unit.prefixes.find(prefix.letter) == std::string_view::npos) {
        continue;
      }
      Unit prefixed = unit;
      prefixed.factor = Decimal(unit.factor.mantissa(), unit.factor.exponent() + prefix.exponent);
      return prefixed;
    }
  }
  return std::nullopt;
}

std::optional<Unit> find(std::string_view text) {
  const std::string pointed = with_points(text);
  if (const auto unit = find_exactly(pointed)) return unit;
  for (const auto& [written, meant] : spellings) {
    if (!std::string_view(pointed).ends_with(written)) continue;
    const std::string_view before =
        std::string_view(pointed).substr(0, pointed.size() - written.size());
    if (const auto unit = find_exactly(std::string(before).append(meant))) return unit;
  }
  return std::nullopt;
}

/// Units of this quantity that are written so but for the case: "mW" and "MW".
std::vector<std::string> in_another_case(std::string_view text, std::string_view quantity) {
  std::vector<std::string> found;
  for (const Unit& unit : units) {
    if (unit.quantity != quantity) continue;
    const auto add = [&](std::string candidate) {
      if (same_ignoring_case(candidate, text)) found.push_back(std::move(candidate));
    };
    add(std::string(unit.text));
    for (const Prefix& prefix : prefixes) {
      const bool is_known = unit.prefixes.find(prefix.letter) != std::string_view::npos;
      if (is_known) add(std::string(prefix.text).append(unit.text));
    }
  }
  return found;
}

/// number × factor / divisor, with as many digits as fit; empty when it is too large.
std::optional<Decimal> scaled(const Decimal& number, const Decimal& factor, Wide divisor,
                              int divisor_exponent) {
  constexpr Wide most = std::numeric_limits<std::uint64_t>::max();
  Wide value = Wide{number.magnitude()} * factor.magnitude();
  int exponent = number.exponent() + factor.exponent() - divisor_exponent;
  while (value % divisor != 0 && value / divisor <= most / 10U &&
         value <= std::numeric_limits<Wide>::max() / 10U) {
    value *= 10U;
    --exponent;
  }
  Wide result = value / divisor + (value % divisor >= divisor - value % divisor ? 1U : 0U);
  while (result > most && result % 10U == 0) {
    result /= 10U;
    ++exponent;
  }
  if (result > most) return std::nullopt;
  const Decimal exact(number.sign(), static_cast<std::uint64_t>(result), exponent);
  return exponent > 0 ? exact.with_decimals(0) : exact;
}

/// Without zeros behind the last decimal that says something.
Decimal shortened(const Decimal& number) {
  std::uint64_t magnitude = number.magnitude();
  int exponent = number.exponent();
  while (exponent < 0 && magnitude % 10U == 0) {
    magnitude /= 10U;
    ++exponent;
  }
  return {number.sign(), magnitude, exponent};
}

std::optional<Decimal> converted(const Decimal& number, const Unit& from, const Unit& to) {
  const auto shifted = number.plus(from.offset);
  if (!shifted) return std::nullopt;
  auto result = scaled(*shifted, from.factor, Wide{to.factor.magnitude()} * from.divisor,
                       to.factor.exponent());
  if (result && to.divisor != 1) result = scaled(*result, Decimal(to.divisor), 1, 0);
  if (result) result = result->plus(to.offset.negated());
  return result ? std::optional(shortened(*result)) : std::nullopt;
}

bool is_same(const Unit& a, const Unit& b) {
  return a.factor == b.factor && a.divisor == b.divisor && a.offset == b.offset;
}

/// A number and what stands behind it.
struct Typed {
  Decimal number;
  std::string_view digits;
  std::string_view unit;
};
std::optional<Typed> split_typed(std::string_view text) {
  const std::size_t digits = text.find_first_not_of("+-.0123456789eE");
  for (std::size_t size = std::min(digits, text.size()); size > 0; --size) {
    const auto number = parse_scientific(text.substr(0, size));
    if (!number) continue;
    std::string_view unit = text.substr(size);
    const std::size_t begin = unit.find_first_not_of(' ');
    if (begin == std::string_view::npos) return std::nullopt;
    unit.remove_prefix(begin);
    constexpr std::string_view never_first = ",./:;_+-*'";
    if (never_first.find(unit.front()) != std::string_view::npos) return std::nullopt;
    if (unit.front() == 'x' || unit.front() == 'X') return std::nullopt;  // 0x1F
    // Digits that are grouped, by a narrow space, say.
    const auto behind = std::find_if(unit.begin(), unit.end(), [](char character) {
      return static_cast<unsigned char>(character) < 0x80;
    });
    if (behind != unit.end() && *behind >= '0' && *behind <= '9') return std::nullopt;
    return Typed{*number, text.substr(0, size), unit};
  }
  return std::nullopt;
}

Error refused(std::string message, std::string hint) {
  return {.code = Errc::bad_value, .message = std::move(message), .hint = std::move(hint)};
}

Error unknown_unit(const Typed& typed, std::string_view unit, const std::optional<Unit>& known) {
  const auto alike =
      known ? in_another_case(typed.unit, known->quantity) : std::vector<std::string>();
  return refused(fmt::format("'{}' is no unit that is known, and this is in {}", typed.unit, unit),
                 alike.empty()
                     ? fmt::format("write the number in {}", unit)
                     : fmt::format("case matters: did you mean {}?", fmt::join(alike, " or ")));
}

}  // namespace

Result<Converted> convert_typed(std::string_view text, std::string_view unit) {
  const auto typed = split_typed(text);
  if (!typed) return Converted{std::string(text)};
  const Converted alone{std::string(typed->digits)};
  const auto from = find(typed->unit);
  if (unit.empty() && !from) return Converted{std::string(text)};
  if (unit.empty()) {
    return tl::unexpected(
        refused(fmt::format("'{}' has a unit, and the parameter has none that is known", text),
                "write the number alone"));
  }
  if (typed->unit == unit) return alone;
  const auto to = find(unit);
  if (!from) return tl::unexpected(unknown_unit(*typed, unit, to));
  if (!to || from->quantity != to->quantity) {
    const std::string what = to ? fmt::format("{} in {}", to->quantity, unit) : std::string(unit);
    return tl::unexpected(
        refused(fmt::format("{} {} is {}, and this is {}", typed->digits, typed->unit,
                            from->quantity, to ? what : "in " + what),
                fmt::format("write the number in {}", unit)));
  }
  if (is_same(*from, *to)) return alone;
  const auto number = converted(typed->number, *from, *to);
  if (!number) {
    return tl::unexpected(
        refused(fmt::format("{} {} has too many digits in {}", typed->digits, typed->unit, unit),
                fmt::format("write the number in {}", unit)));
  }
  const std::string result = number->to_string();
  return Converted{result, fmt::format("{} {} is {} {}", typed->digits, typed->unit, result, unit)};
}

bool is_torque(std::string_view unit) {
  const auto known = find(unit);
  return known && known->quantity == torque;
}

}  // namespace spindle::catalogue
