#pragma once

#include <string>
#include <string_view>

#include "spindle/base/bytes.hpp"
#include "spindle/base/error.hpp"
#include "spindle/catalogue/parameter.hpp"

namespace spindle::catalogue {

/// A decoded value: always an exact number, with its label when the parameter is an enumeration
/// that names it, the names of its bits ("M1 FWD") when it is a bit field, or "30h" when it is a
/// code.
struct Value {
  Decimal number;
  std::string label;  ///< empty when there is none

  /// The label, else the number.
  [[nodiscard]] std::string to_string() const { return label.empty() ? number.to_string() : label; }
  friend bool operator==(const Value& a, const Value& b) { return a.number == b.number; }
};

/// Registers to value. Requires as many registers as the kind has; error `internal` otherwise.
Result<Value> decode(const Parameter& parameter, RegisterView registers);

/// Value to registers, exact. Error `bad_value` when the number lies between two steps of the
/// scale, `out_of_range` when it does not fit the kind.
Result<Registers> encode(const Parameter& parameter, const Decimal& number);

/// What a user typed: a number ("2.71", "0x1F" where the scale is 1), a label of the enumeration,
/// or names of bits joined by '+' or ',' (ASCII case ignored). Checked against encoding, labels and the profile's range. Errors
/// `bad_value` (with a suggestion for labels) and `out_of_range`.
Result<Value> parse_value(const Parameter& parameter, std::string_view text);

/// `out_of_range` when the number is outside; the message names limit and `whose` ("of the
/// profile").
Result<void> check_range(const Parameter& parameter, const Decimal& number);

}  // namespace spindle::catalogue
