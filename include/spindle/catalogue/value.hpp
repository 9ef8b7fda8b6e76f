#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "spindle/base/bytes.hpp"
#include "spindle/base/error.hpp"
#include "spindle/catalogue/parameter.hpp"

namespace spindle::catalogue {

/// What a value is.
enum class Content : std::uint8_t {
  number,
  text,
  list,  ///< several, one behind the other
  none,  ///< the device says that there is none, or what it sends is no number
  raw,   ///< registers that hold what the encoding does not have, and nothing else is known of it
};

/// A decoded value: an exact number with its label when the parameter is an enumeration that names
/// it, the names of its bits ("M1 FWD") when it is a bit field, or "30h" when it is a code; a text;
/// none, with a label that says why ("NaN"); or raw, with a label such as "not a date: FFFF 0000".
struct Value {
  Decimal number = {};
  std::string label = {};  ///< empty when there is none
  Content content = Content::number;
  std::string text = {};
  /// So many are shown of the number; empty: as many as it has.
  std::optional<std::uint8_t> decimals = std::nullopt;
  std::vector<Value> elements = {};
  /// What was typed, where the nearest step is another number.
  std::optional<Decimal> typed = std::nullopt;
  /// The registers that it was decoded from: they tell values apart that a number of 64 bits does
  /// not, and are what is put back. Empty where they are not known, or hold more than the value.
  Registers held = {};

  [[nodiscard]] bool is_number() const { return content == Content::number; }
  /// Whether it, or one of its elements, is another number than was typed.
  [[nodiscard]] bool is_rounded() const;
  /// The number with the decimals that are shown.
  [[nodiscard]] Decimal shown_number() const {
    return decimals ? number.with_decimals(*decimals) : number;
  }
  /// The label, else the number or the text; "-" where there is none.
  [[nodiscard]] std::string to_string() const;
  /// Enough to make the same value of it again: the number with all its decimals.
  [[nodiscard]] std::string exact() const;
  /// Of what is stored, however it is shown: of numbers also the registers, where both are known.
  friend bool operator==(const Value& a, const Value& b);
};

/// Registers to value. Requires as many registers as the encoding has; error `internal` otherwise.
/// Error `bad_value` where they hold what the encoding does not have, such as a BCD digit above 9.
Result<Value> decode(const Parameter& parameter, RegisterView registers);

/// The same, but registers that hold what the encoding does not have, and bytes that are no
/// characters, are a value that is raw. Error `internal` only.
Result<Value> decode_or_raw(const Parameter& parameter, RegisterView registers);

/// The power of ten that a value stands for; empty: it is no number, or a power that no scale has.
std::optional<std::int64_t> power_of(const Value& value);

/// Value to registers, exact. A value that was decoded from registers is what they held.
/// `present` is what they hold now: needed where only some of their bits
/// are the value's. Error `bad_value` when the number lies between two steps of the scale, or there
/// is none, `out_of_range` when it does not fit the encoding.
Result<Registers> encode(const Parameter& parameter, const Value& value, RegisterView present = {});

/// The value as people read it; of a secret only that it is one.
std::string shown_of(const Parameter& parameter, const Value& value);

/// What a user typed: a number ("2.71", "0x1F" where the scale is 1), a label of the enumeration,
/// names of bits joined by '+' or ',' (ASCII case ignored), a text, or elements joined by ','. A
/// number between two steps becomes the nearest one, which Value::typed tells. Checked against
/// encoding, labels and the profile's range. Errors `bad_value` (with a suggestion for labels) and
/// `out_of_range`.
Result<Value> parse_value(const Parameter& parameter, std::string_view text);

/// The same, but a number between two steps is refused (`bad_value`): where it is not typed, or no
/// other number may be meant.
Result<Value> parse_exact_value(const Parameter& parameter, std::string_view text);

/// "2.715 is between two steps of 0.01, so it is 2.72": of a value that was rounded; of each
/// element of a list that was.
std::string rounding_in_words(const Parameter& parameter, const Value& value);

/// `out_of_range` when the number is outside; the message names limit and `whose` ("of the
/// profile"). A value that is no number is never outside.
Result<void> check_range(const Parameter& parameter, const Value& value);

}  // namespace spindle::catalogue
