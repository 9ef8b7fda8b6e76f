#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "spindle/base/bytes.hpp"
#include "spindle/catalogue/encoding.hpp"

namespace spindle::catalogue {

// What stands in registers, without the meaning that a parameter gives it.

/// A floating-point number as the shortest decimal that is read back as the same bits; or the word
/// for one that is no number: "NaN", "inf", "-inf".
struct FloatNumber {
  std::optional<Decimal> number;
  std::string word = {};
};
FloatNumber float_of(Kind kind, std::uint64_t pattern);
/// "1.5e-7", as floating-point numbers are typed; empty where it is none, or out of all bounds.
std::optional<Decimal> parse_scientific(std::string_view text);

/// The pattern of the nearest floating-point number; empty when it is beyond all of them.
std::optional<std::uint64_t> float_pattern(Kind kind, const Decimal& number);

/// Empty where a digit is above 9.
std::optional<std::uint64_t> bcd_number(std::uint64_t pattern);
/// Requires a number that fits.
std::uint64_t bcd_pattern(std::uint64_t number);

/// The characters, without what fills them up.
std::string text_of(const Encoding& encoding, RegisterView registers);
/// Empty when it is too long.
std::optional<Registers> text_registers(const Encoding& encoding, std::string_view text);

/// "2026-11-22 10:15:30"; an empty text where all is 0; nothing where it is no date.
std::optional<std::string> date_of(const Encoding& encoding, RegisterView registers);
/// Of "2026-11-22 10:15:30", "2026-11-22T10:15:30" or "2026-11-22"; nothing where it is no date, or
/// none that the layout can hold.
std::optional<Registers> date_registers(const Encoding& encoding, std::string_view text);

}  // namespace spindle::catalogue
