#pragma once

#include <compare>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace spindle {

/// An exact decimal number: mantissa × 10^exponent. Keeps its number of decimals (10.00 stays
/// 10.00), so a register with two decimals is always shown with two. Registers need 32 bits and a
/// scale of at most nine decimals; anything that would not fit 64 bits is rejected, never rounded.
class Decimal {
 public:
  constexpr Decimal() = default;
  constexpr Decimal(std::int64_t mantissa, int exponent)
      : mantissa_(mantissa), exponent_(exponent) {}
  constexpr explicit Decimal(std::int64_t integer) : mantissa_(integer) {}

  /// Reads "-12", "2.71", "+0.5", ".5". No exponent, no spaces, no separators, point only.
  /// Empty when the text is not such a number or does not fit.
  static std::optional<Decimal> parse(std::string_view text);

  [[nodiscard]] constexpr std::int64_t mantissa() const { return mantissa_; }
  [[nodiscard]] constexpr int exponent() const { return exponent_; }

  /// Plain notation, a valid JSON number: "2.71", "10.00", "-0.05", "1200". Never an exponent.
  [[nodiscard]] std::string to_string() const;

  /// this × other, exact; empty when it does not fit.
  [[nodiscard]] std::optional<Decimal> times(const Decimal& other) const;

  /// The integer n for which n × unit == this; empty when there is none (a value between two steps)
  /// or it does not fit. `unit` must not be zero.
  [[nodiscard]] std::optional<std::int64_t> divided_by(const Decimal& unit) const;

  /// Equality and order are numeric: 10.00 == 10.
  friend bool operator==(const Decimal& a, const Decimal& b);
  friend std::strong_ordering operator<=>(const Decimal& a, const Decimal& b);

 private:
  std::int64_t mantissa_ = 0;
  int exponent_ = 0;
};

}  // namespace spindle
