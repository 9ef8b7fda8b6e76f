#pragma once

#include <algorithm>
#include <compare>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>

namespace spindle {

/// Whether a number is below zero.
enum class Sign : std::uint8_t { plus, minus };

/// An exact decimal number: ± magnitude × 10^exponent. Keeps its number of decimals (10.00 stays
/// 10.00), so a register with two decimals is always shown with two. Anything whose magnitude would
/// not fit 64 bits is rejected, never rounded, unless rounding is what was asked for.
class Decimal {
 public:
  constexpr Decimal() = default;
  constexpr Decimal(std::int64_t mantissa, int exponent)
      : magnitude_(mantissa < 0 ? 0U - static_cast<std::uint64_t>(mantissa)
                                : static_cast<std::uint64_t>(mantissa)),
        exponent_(exponent),
        sign_(mantissa < 0 ? Sign::minus : Sign::plus) {}
  constexpr explicit Decimal(std::int64_t integer) : Decimal(integer, 0) {}
  /// Zero has no sign.
  constexpr Decimal(Sign sign, std::uint64_t magnitude, int exponent)
      : magnitude_(magnitude), exponent_(exponent), sign_(magnitude == 0 ? Sign::plus : sign) {}

  /// Reads "-12", "2.71", "+0.5", ".5". No exponent, no spaces, no separators, point only.
  /// Empty when the text is not such a number, does not fit, or has more than 330 decimals.
  static std::optional<Decimal> parse(std::string_view text);

  [[nodiscard]] constexpr Sign sign() const { return sign_; }
  [[nodiscard]] constexpr std::uint64_t magnitude() const { return magnitude_; }
  /// With its sign. Requires one that fits 64 bits with it, as every value of 32 bits does; the
  /// nearest such number otherwise.
  [[nodiscard]] constexpr std::int64_t mantissa() const {
    constexpr auto largest = static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max());
    if (sign_ == Sign::plus) return static_cast<std::int64_t>(std::min(magnitude_, largest));
    return static_cast<std::int64_t>(0U - std::min(magnitude_, largest + 1));
  }
  [[nodiscard]] constexpr int exponent() const { return exponent_; }

  /// Plain notation, a valid JSON number: "2.71", "10.00", "-0.05", "1200". Never an exponent.
  [[nodiscard]] std::string to_string() const;

  /// this × other, exact; empty when it does not fit.
  [[nodiscard]] std::optional<Decimal> times(const Decimal& other) const;

  /// The integer n for which n × unit == this; empty when there is none (a value between two steps)
  /// or it does not fit. `unit` must not be zero.
  [[nodiscard]] std::optional<std::int64_t> divided_by(const Decimal& unit) const;

  /// this + other, exact; empty when it does not fit.
  [[nodiscard]] std::optional<Decimal> plus(const Decimal& other) const;
  [[nodiscard]] constexpr Decimal negated() const {
    return {sign_ == Sign::plus ? Sign::minus : Sign::plus, magnitude_, exponent_};
  }

  /// The nearest number with so many decimals; a half is rounded away from zero. One that has fewer
  /// gets zeros, as far as they fit.
  [[nodiscard]] Decimal with_decimals(int decimals) const;

  /// Equality and order are numeric: 10.00 == 10.
  friend bool operator==(const Decimal& a, const Decimal& b);
  friend std::strong_ordering operator<=>(const Decimal& a, const Decimal& b);

 private:
  std::uint64_t magnitude_ = 0;
  int exponent_ = 0;
  Sign sign_ = Sign::plus;
};

}  // namespace spindle
