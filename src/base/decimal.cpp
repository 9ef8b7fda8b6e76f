#include "spindle/base/decimal.hpp"

#include <numeric>

namespace spindle {
namespace {

// The smallest number of 64-bit floating point has as many.
constexpr std::size_t most_decimals = 330;

// Every number of so many digits fits 64 bits.
constexpr std::size_t usual_digits = 19;

constexpr bool is_digit(char c) { return c >= '0' && c <= '9'; }

int count_digits(std::uint64_t value) {
  int digits = 0;
  for (; value != 0; value /= 10U) ++digits;
  return digits;
}

int sign_of(const Decimal& number) {
  if (number.magnitude() == 0) return 0;
  return number.sign() == Sign::plus ? 1 : -1;
}

// value × 10^tens; empty when it does not fit.
std::optional<std::uint64_t> times_ten(std::uint64_t value, std::int64_t tens) {
  for (; tens > 0 && value != 0; --tens) {
    if (__builtin_mul_overflow(value, std::uint64_t{10}, &value)) return std::nullopt;
  }
  return value;
}

// Both are non-zero. When their first digits stand at the same place, the exponents differ by no
// more than the digit counts do, so lining them up needs no more than 20 digits; where that does
// not fit 64 bits, the other one, which does, is less.
std::strong_ordering compare_magnitudes(const Decimal& a, const Decimal& b) {
  const std::int64_t left_place = std::int64_t{a.exponent()} + count_digits(a.magnitude());
  const std::int64_t right_place = std::int64_t{b.exponent()} + count_digits(b.magnitude());
  if (left_place != right_place) return left_place <=> right_place;
  const auto left = times_ten(a.magnitude(), std::int64_t{a.exponent()} - b.exponent());
  const auto right = times_ten(b.magnitude(), std::int64_t{b.exponent()} - a.exponent());
  if (!left) return std::strong_ordering::greater;
  if (!right) return std::strong_ordering::less;
  return *left <=> *right;
}

// value × 10^tens / divisor when that is an integer. `value` and `divisor` have no common factor;
// cancelling before multiplying keeps every intermediate at or below the result.
std::optional<std::uint64_t> scale_up(std::uint64_t value, std::uint64_t divisor,
                                      std::int64_t tens) {
  for (; tens > 0; --tens) {
    const std::uint64_t common = std::gcd(divisor, std::uint64_t{10});
    divisor /= common;
    if (__builtin_mul_overflow(value, 10U / common, &value)) return std::nullopt;
  }
  if (divisor != 1) return std::nullopt;
  return value;
}

std::optional<std::uint64_t> scale_down(std::uint64_t value, std::int64_t tens) {
  for (; tens > 0; --tens) {
    if (value % 10U != 0) return std::nullopt;
    value /= 10U;
  }
  return value;
}

std::size_t trailing_zeros(std::string_view digits) {
  const std::size_t last = digits.find_last_not_of('0');
  return last == std::string_view::npos ? 0 : digits.size() - 1 - last;
}

// The digits of a text, point taken out; empty when something else is there, or too much.
std::optional<std::uint64_t> read_digits(std::string_view whole, std::string_view fraction) {
  std::uint64_t value = 0;
  for (const std::string_view part : {whole, fraction}) {
    for (const char c : part) {
      if (!is_digit(c)) return std::nullopt;
      if (__builtin_mul_overflow(value, std::uint64_t{10}, &value)) return std::nullopt;
      if (__builtin_add_overflow(value, static_cast<std::uint64_t>(c - '0'), &value)) {
        return std::nullopt;
      }
    }
  }
  return value;
}

}  // namespace

std::optional<Decimal> Decimal::parse(std::string_view text) {
  const Sign sign = text.starts_with('-') ? Sign::minus : Sign::plus;
  if (sign == Sign::minus || text.starts_with('+')) text.remove_prefix(1);

  const std::size_t point = text.find('.');
  const std::string_view whole = text.substr(0, point);
  const std::string_view fraction =
      point == std::string_view::npos ? std::string_view{} : text.substr(point + 1);
  const bool needs_fraction = point != std::string_view::npos || whole.empty();
  if (needs_fraction && fraction.empty()) return std::nullopt;

  if (fraction.size() > most_decimals || whole.size() > most_decimals) return std::nullopt;
  // The largest numbers of floating point are digits with many zeros behind them.
  const std::size_t zeros =
      whole.size() > usual_digits && fraction.empty() ? trailing_zeros(whole) : 0;
  const auto digits = read_digits(whole.substr(0, whole.size() - zeros), fraction);
  if (!digits) return std::nullopt;
  return Decimal(sign, *digits, static_cast<int>(zeros) - static_cast<int>(fraction.size()));
}

std::string Decimal::to_string() const {
  std::string text = std::to_string(magnitude_);
  if (exponent_ > 0 && magnitude_ != 0) text.append(static_cast<std::size_t>(exponent_), '0');
  if (exponent_ < 0) {
    const auto decimals = static_cast<std::size_t>(-std::int64_t{exponent_});
    if (text.size() <= decimals) text.insert(0, decimals + 1 - text.size(), '0');
    text.insert(text.size() - decimals, 1, '.');
  }
  return sign_ == Sign::minus ? "-" + text : text;
}

std::optional<Decimal> Decimal::times(const Decimal& other) const {
  std::uint64_t magnitude = 0;
  int exponent = 0;
  if (__builtin_mul_overflow(magnitude_, other.magnitude_, &magnitude)) return std::nullopt;
  if (__builtin_add_overflow(exponent_, other.exponent_, &exponent)) return std::nullopt;
  return Decimal(sign_ == other.sign_ ? Sign::plus : Sign::minus, magnitude, exponent);
}

std::optional<Decimal> Decimal::plus(const Decimal& other) const {
  if (other.magnitude_ == 0 && other.exponent_ >= exponent_) return *this;
  const int exponent = std::min(exponent_, other.exponent_);
  const auto left = times_ten(magnitude_, std::int64_t{exponent_} - exponent);
  const auto right = times_ten(other.magnitude_, std::int64_t{other.exponent_} - exponent);
  if (!left || !right) return std::nullopt;
  if (sign_ != other.sign_) {
    const bool is_left = *left >= *right;
    return Decimal(is_left ? sign_ : other.sign_, is_left ? *left - *right : *right - *left,
                   exponent);
  }
  std::uint64_t sum = 0;
  if (__builtin_add_overflow(*left, *right, &sum)) return std::nullopt;
  return Decimal(sign_, sum, exponent);
}

std::optional<std::int64_t> Decimal::divided_by(const Decimal& unit) const {
  if (unit.magnitude_ == 0) return std::nullopt;
  if (magnitude_ == 0) return 0;

  const std::uint64_t common = std::gcd(magnitude_, unit.magnitude_);
  const std::uint64_t value = magnitude_ / common;
  const std::uint64_t divisor = unit.magnitude_ / common;
  const std::int64_t tens = std::int64_t{exponent_} - unit.exponent_;
  if (tens < 0 && divisor != 1) return std::nullopt;

  const auto result = tens < 0 ? scale_down(value, -tens) : scale_up(value, divisor, tens);
  if (!result) return std::nullopt;
  const Decimal quotient(sign_ == unit.sign_ ? Sign::plus : Sign::minus, *result, 0);
  if (Decimal(quotient.mantissa()) != quotient) return std::nullopt;
  return quotient.mantissa();
}

Decimal Decimal::with_decimals(int decimals) const {
  const std::int64_t tens = std::int64_t{exponent_} + decimals;
  if (tens >= 0) {
    const auto grown = times_ten(magnitude_, tens);
    return grown ? Decimal(sign_, *grown, -decimals) : *this;
  }
  std::uint64_t magnitude = magnitude_;
  std::uint64_t last = 0;
  for (std::int64_t left = -tens; left > 0; --left) {
    last = magnitude % 10U;
    magnitude /= 10U;
    if (magnitude == 0 && left > 1) {
      last = 0;
      break;
    }
  }
  constexpr std::uint64_t half = 5;
  return {sign_, magnitude + (last >= half ? 1U : 0U), -decimals};
}

bool operator==(const Decimal& a, const Decimal& b) {
  return (a <=> b) == std::strong_ordering::equal;
}

std::strong_ordering operator<=>(const Decimal& a, const Decimal& b) {
  const int left = sign_of(a);
  const int right = sign_of(b);
  if (left != right) return left <=> right;
  if (left == 0) return std::strong_ordering::equal;
  return left > 0 ? compare_magnitudes(a, b) : compare_magnitudes(b, a);
}

}  // namespace spindle
