#include "spindle/base/decimal.hpp"

#include <limits>
#include <numeric>

namespace spindle {
namespace {

constexpr int max_digits = 18;  // every number of so many digits fits 64 bits

constexpr bool is_digit(char c) { return c >= '0' && c <= '9'; }

// The most negative mantissa has no positive counterpart, so magnitudes are unsigned.
constexpr std::uint64_t magnitude(std::int64_t value) {
  const auto bits = static_cast<std::uint64_t>(value);
  return value < 0 ? 0U - bits : bits;
}

// `sign` as of sign_of().
std::optional<std::int64_t> with_sign(std::uint64_t value, int sign) {
  constexpr auto largest = static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max());
  if (value > largest + (sign < 0 ? 1U : 0U)) return std::nullopt;
  return static_cast<std::int64_t>(sign < 0 ? 0U - value : value);
}

int count_digits(std::uint64_t value) {
  int digits = 0;
  for (; value != 0; value /= 10U) ++digits;
  return digits;
}

int sign_of(std::int64_t value) { return (value > 0 ? 1 : 0) - (value < 0 ? 1 : 0); }

// Both are non-zero. When their first digits stand at the same place, the exponents differ by no
// more than the digit counts do, so lining them up stays below 10^19 and thus within 64 bits.
std::strong_ordering compare_magnitudes(const Decimal& a, const Decimal& b) {
  std::uint64_t left = magnitude(a.mantissa());
  std::uint64_t right = magnitude(b.mantissa());
  const std::int64_t left_place = std::int64_t{a.exponent()} + count_digits(left);
  const std::int64_t right_place = std::int64_t{b.exponent()} + count_digits(right);
  if (left_place != right_place) return left_place <=> right_place;
  for (int exponent = a.exponent(); exponent > b.exponent(); --exponent) left *= 10U;
  for (int exponent = b.exponent(); exponent > a.exponent(); --exponent) right *= 10U;
  return left <=> right;
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

// The digits of a text, point taken out; empty when something else is there.
struct Digits {
  std::uint64_t value = 0;
  int significant = 0;
  int decimals = 0;
};

std::optional<Digits> read_digits(std::string_view whole, std::string_view fraction) {
  Digits digits;
  for (const std::string_view part : {whole, fraction}) {
    for (const char c : part) {
      if (!is_digit(c)) return std::nullopt;
      if (digits.significant > 0 || c != '0') ++digits.significant;
      if (digits.significant > max_digits) return std::nullopt;
      digits.value = digits.value * 10U + static_cast<std::uint64_t>(c - '0');
    }
  }
  if (fraction.size() > max_digits) return std::nullopt;
  digits.decimals = static_cast<int>(fraction.size());
  return digits;
}

}  // namespace

std::optional<Decimal> Decimal::parse(std::string_view text) {
  const int sign = text.starts_with('-') ? -1 : 1;
  if (sign < 0 || text.starts_with('+')) text.remove_prefix(1);

  const std::size_t point = text.find('.');
  const std::string_view whole = text.substr(0, point);
  const std::string_view fraction =
      point == std::string_view::npos ? std::string_view{} : text.substr(point + 1);
  const bool needs_fraction = point != std::string_view::npos || whole.empty();
  if (needs_fraction && fraction.empty()) return std::nullopt;

  const auto digits = read_digits(whole, fraction);
  if (!digits) return std::nullopt;
  const auto mantissa = with_sign(digits->value, sign);
  if (!mantissa) return std::nullopt;
  return Decimal(*mantissa, -digits->decimals);
}

std::string Decimal::to_string() const {
  std::string text = std::to_string(magnitude(mantissa_));
  if (exponent_ > 0 && mantissa_ != 0) text.append(static_cast<std::size_t>(exponent_), '0');
  if (exponent_ < 0) {
    const auto decimals = static_cast<std::size_t>(-std::int64_t{exponent_});
    if (text.size() <= decimals) text.insert(0, decimals + 1 - text.size(), '0');
    text.insert(text.size() - decimals, 1, '.');
  }
  return mantissa_ < 0 ? "-" + text : text;
}

std::optional<Decimal> Decimal::times(const Decimal& other) const {
  std::int64_t mantissa = 0;
  int exponent = 0;
  if (__builtin_mul_overflow(mantissa_, other.mantissa_, &mantissa)) return std::nullopt;
  if (__builtin_add_overflow(exponent_, other.exponent_, &exponent)) return std::nullopt;
  return Decimal(mantissa, exponent);
}

std::optional<std::int64_t> Decimal::divided_by(const Decimal& unit) const {
  if (unit.mantissa_ == 0) return std::nullopt;
  if (mantissa_ == 0) return 0;

  const std::uint64_t common = std::gcd(magnitude(mantissa_), magnitude(unit.mantissa_));
  const std::uint64_t value = magnitude(mantissa_) / common;
  const std::uint64_t divisor = magnitude(unit.mantissa_) / common;
  const std::int64_t tens = std::int64_t{exponent_} - unit.exponent_;
  if (tens < 0 && divisor != 1) return std::nullopt;

  const auto result = tens < 0 ? scale_down(value, -tens) : scale_up(value, divisor, tens);
  if (!result) return std::nullopt;
  return with_sign(*result, sign_of(mantissa_) * sign_of(unit.mantissa_));
}

bool operator==(const Decimal& a, const Decimal& b) {
  return (a <=> b) == std::strong_ordering::equal;
}

std::strong_ordering operator<=>(const Decimal& a, const Decimal& b) {
  const int left = sign_of(a.mantissa_);
  const int right = sign_of(b.mantissa_);
  if (left != right) return left <=> right;
  if (left == 0) return std::strong_ordering::equal;
  return left > 0 ? compare_magnitudes(a, b) : compare_magnitudes(b, a);
}

}  // namespace spindle
