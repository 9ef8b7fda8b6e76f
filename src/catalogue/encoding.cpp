#include "spindle/catalogue/encoding.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

namespace spindle::catalogue {
namespace {

__extension__ using Wide = unsigned __int128;

constexpr unsigned bits_per_byte = 8;
constexpr unsigned bits_per_register = 16;
constexpr unsigned most_bits = 64;
constexpr std::uint16_t bytes_per_register = 2;

std::uint16_t halved(std::uint16_t bytes) {
  return static_cast<std::uint16_t>((bytes + 1U) / bytes_per_register);
}

std::uint16_t registers_of_date(DateLayout layout) {
  switch (layout) {
    case DateLayout::registers:
    case DateLayout::long_year:
      return 6;
    case DateLayout::bytes:
      return 3;
    case DateLayout::year_and_bytes:
      return 4;
    case DateLayout::unix_time:
      break;
  }
  return 2;
}

std::uint16_t registers_of_one(const Encoding& encoding) {
  switch (encoding.kind) {
    case Kind::u16:
    case Kind::i16:
    case Kind::u8:
    case Kind::i8:
      return 1;
    case Kind::bit:
      return static_cast<std::uint16_t>(
          1 + (encoding.slice.first + std::max(1, int{encoding.slice.width}) - 1) /
                  int{bits_per_register});
    case Kind::u32:
    case Kind::i32:
    case Kind::f32:
      return 2;
    case Kind::u64:
    case Kind::i64:
    case Kind::f64:
      return 4;
    case Kind::bcd:
      return halved(encoding.length);
    case Kind::text:
      return encoding.packing == Packing::low ? encoding.length : halved(encoding.length);
    case Kind::date:
      return registers_of_date(encoding.date);
  }
  return 1;
}

bool is_signed(Kind kind) {
  return kind == Kind::i8 || kind == Kind::i16 || kind == Kind::i32 || kind == Kind::i64;
}

/// How many bits of the pattern count.
unsigned width_of(const Encoding& encoding) {
  if (!encoding.slice.is_whole()) return encoding.slice.width;
  if (encoding.kind == Kind::bit) return 1;
  return std::min(most_bits, registers_of_one(encoding) * bits_per_register);
}

std::uint64_t low_bits(unsigned width) {
  return width >= most_bits ? ~std::uint64_t{0} : (std::uint64_t{1} << width) - 1;
}

std::uint16_t swapped(std::uint16_t word) {
  return static_cast<std::uint16_t>((word << bits_per_byte) | (word >> bits_per_byte));
}

/// The bits of the slice from `pattern`, the others from `present`.
std::uint64_t with_slice(const Encoding& encoding, std::uint64_t pattern, std::uint64_t present) {
  const std::uint64_t mask = low_bits(encoding.slice.width) << encoding.slice.first;
  return (pattern & mask) | (present & ~mask);
}

void fill(const Encoding& encoding, std::uint64_t pattern, std::span<std::uint16_t> registers) {
  for (std::size_t i = registers.size(); i > 0; --i) {
    const bool is_big = encoding.word_order == WordOrder::big;
    const auto word = static_cast<std::uint16_t>(pattern);
    registers[is_big ? i - 1 : registers.size() - i] =
        encoding.byte_order == ByteOrder::big ? word : swapped(word);
    pattern >>= bits_per_register;
  }
}

/// Whether a number is what is stored, to the digit.
bool is_as_stored(const Encoding& encoding) {
  return encoding.scale.magnitude() == 1 && encoding.scale.exponent() == 0 &&
         encoding.scale.sign() == Sign::plus && encoding.divisor == 1 &&
         encoding.offset.magnitude() == 0;
}

/// value × 10^tens; empty when it does not fit.
std::optional<Wide> times_ten(Wide value, std::int64_t tens) {
  for (; tens > 0 && value != 0; --tens) {
    if (__builtin_mul_overflow(value, Wide{10}, &value)) return std::nullopt;
  }
  return value;
}

std::optional<Decimal> narrowed(Sign sign, Wide magnitude, int exponent) {
  // Decimals that are nothing but zeros may go; others are worth more than being shown.
  while (magnitude > std::numeric_limits<std::uint64_t>::max() && magnitude % 10U == 0) {
    magnitude /= 10U;
    ++exponent;
  }
  if (magnitude > std::numeric_limits<std::uint64_t>::max()) return std::nullopt;
  return Decimal(sign, static_cast<std::uint64_t>(magnitude), exponent);
}

/// Two numbers with one exponent, as far as they fit.
struct Aligned {
  Wide left;
  Wide right;
};
std::optional<Aligned> align(Wide left, int left_exponent, Wide right, int right_exponent) {
  const auto grown_left = times_ten(left, std::int64_t{left_exponent} - right_exponent);
  const auto grown_right = times_ten(right, std::int64_t{right_exponent} - left_exponent);
  if (!grown_left || !grown_right) return std::nullopt;
  return Aligned{*grown_left, *grown_right};
}

Integer step_of(const Decimal& number, const Decimal& scale, std::uint64_t steps) {
  const Sign sign = number.sign() == scale.sign() || steps == 0 ? Sign::plus : Sign::minus;
  return {sign, steps};
}

/// How many decimals tell the steps of a fraction apart, with two more.
constexpr int most_decimals_of_fraction = 18;

/// dividend / divisor as a decimal: exact where it ends, else rounded.
std::optional<Decimal> quotient(Sign sign, Wide dividend, int exponent, std::uint32_t divisor) {
  int tens = 0;
  Wide value = dividend;
  while (value % divisor != 0 && tens < most_decimals_of_fraction) {
    const auto grown = times_ten(value, 1);
    if (!grown || *grown / divisor > std::numeric_limits<std::uint64_t>::max()) break;
    value = *grown;
    ++tens;
  }
  const Wide rest = value % divisor;
  const Wide whole = value / divisor + (rest * 2U >= divisor && rest != 0 ? 1U : 0U);
  return narrowed(sign, whole, exponent - tens);
}

/// Exact, or nothing. What is rounded in any case has as many digits as fit.
std::optional<Decimal> with_offset(const Encoding& encoding, const Decimal& number) {
  const bool is_rounded = encoding.decimals || encoding.divisor != 1;
  auto sum = number.plus(encoding.offset);
  if (!is_rounded) return sum;
  const int fewest = encoding.decimals.value_or(0);
  for (int decimals = most_decimals_of_fraction; !sum && decimals >= fewest; --decimals) {
    sum = number.with_decimals(decimals).plus(encoding.offset);
  }
  return sum;
}

}  // namespace

bool Encoding::is_integer() const {
  switch (kind) {
    case Kind::f32:
    case Kind::f64:
    case Kind::text:
    case Kind::date:
      return false;
    default:
      return true;
  }
}

std::uint16_t register_count(const Encoding& encoding) {
  return static_cast<std::uint16_t>(registers_of_one(encoding) * encoding.count);
}

Decimal lowest(const Encoding& encoding) {
  if (!is_signed(encoding.kind)) return Decimal(0);
  return {Sign::minus, std::uint64_t{1} << (width_of(encoding) - 1), 0};
}

Decimal highest(const Encoding& encoding) {
  if (encoding.kind == Kind::bcd) {
    std::uint64_t value = 0;
    for (unsigned digit = 0; digit < unsigned{encoding.length} * 2; ++digit) value = value * 10 + 9;
    return {Sign::plus, value, 0};
  }
  const unsigned width = width_of(encoding);
  return {Sign::plus, low_bits(is_signed(encoding.kind) ? width - 1 : width), 0};
}

std::string step_in_words(const Encoding& encoding) {
  const std::string scale = encoding.scale.to_string();
  return encoding.divisor == 1 ? scale : fmt::format("{}/{}", scale, encoding.divisor);
}

std::uint64_t to_pattern(const Encoding& encoding, RegisterView registers) {
  std::uint64_t pattern = 0;
  for (std::size_t i = 0; i < registers.size(); ++i) {
    const bool is_big = encoding.word_order == WordOrder::big;
    const std::uint16_t word = registers[is_big ? i : registers.size() - 1 - i];
    pattern = (pattern << bits_per_register) |
              (encoding.byte_order == ByteOrder::big ? word : swapped(word));
  }
  return pattern;
}

Registers to_registers(const Encoding& encoding, std::uint64_t pattern, std::uint64_t present) {
  if (encoding.is_part()) pattern = with_slice(encoding, pattern, present);
  Registers registers(registers_of_one(encoding));
  fill(encoding, pattern, registers);
  return registers;
}

void put_pattern(const Encoding& encoding, std::uint64_t pattern,
                 std::span<std::uint16_t> registers) {
  if (encoding.is_part()) pattern = with_slice(encoding, pattern, to_pattern(encoding, registers));
  fill(encoding, pattern, registers);
}

Integer to_integer(const Encoding& encoding, std::uint64_t pattern) {
  const unsigned width = width_of(encoding);
  const std::uint64_t value = (pattern >> encoding.slice.first) & low_bits(width);
  const bool is_negative = is_signed(encoding.kind) && ((value >> (width - 1)) & 1U) != 0;
  if (!is_negative) return {Sign::plus, value};
  return {Sign::minus, low_bits(width) - value + 1};
}

std::uint64_t to_pattern(const Encoding& encoding, const Integer& integer) {
  const std::uint64_t value =
      integer.sign == Sign::plus ? integer.magnitude : 0U - integer.magnitude;
  return (value & low_bits(width_of(encoding))) << encoding.slice.first;
}

std::optional<Decimal> scaled(const Encoding& encoding, const Decimal& stored) {
  if (is_as_stored(encoding)) return stored;
  const Decimal& scale = encoding.scale;
  Wide product = 0;
  if (__builtin_mul_overflow(Wide{stored.magnitude()}, Wide{scale.magnitude()}, &product)) {
    return std::nullopt;
  }
  const Sign sign = stored.sign() == scale.sign() ? Sign::plus : Sign::minus;
  const int exponent = stored.exponent() + scale.exponent();
  const auto number = encoding.divisor == 1 ? narrowed(sign, product, exponent)
                                            : quotient(sign, product, exponent, encoding.divisor);
  if (!number || encoding.offset.magnitude() == 0) return number;
  return with_offset(encoding, *number);
}

std::optional<Decimal> unscaled(const Encoding& encoding, const Decimal& number) {
  const auto shifted =
      encoding.offset.magnitude() == 0 ? number : number.plus(encoding.offset.negated());
  const Decimal& scale = encoding.scale;
  const bool is_wide = scale.magnitude() > std::numeric_limits<std::uint32_t>::max();
  if (!shifted || is_wide || scale.magnitude() == 0) return std::nullopt;
  const Sign sign = shifted->sign() == scale.sign() ? Sign::plus : Sign::minus;
  return quotient(sign, Wide{shifted->magnitude()} * encoding.divisor,
                  shifted->exponent() - scale.exponent(),
                  static_cast<std::uint32_t>(scale.magnitude()));
}

std::optional<Integer> nearest_step(const Encoding& encoding, const Decimal& number) {
  const auto shifted =
      encoding.offset.magnitude() == 0 ? number : number.plus(encoding.offset.negated());
  if (!shifted) return std::nullopt;
  const Decimal& scale = encoding.scale;
  // Most numbers have the decimals of their steps.
  if (scale.magnitude() == 1 && encoding.divisor == 1 && shifted->exponent() == scale.exponent()) {
    return step_of(*shifted, scale, shifted->magnitude());
  }
  Wide dividend = 0;
  if (__builtin_mul_overflow(Wide{shifted->magnitude()}, Wide{encoding.divisor}, &dividend)) {
    return std::nullopt;
  }
  auto sides = align(dividend, shifted->exponent(), scale.magnitude(), scale.exponent());
  if (!sides) {
    // A number too small to be lined up is less than half a step.
    const bool is_tiny = shifted->exponent() < scale.exponent();
    return is_tiny ? std::optional(Integer{}) : std::nullopt;
  }
  const auto& [above, below] = *sides;
  const Wide rest = above % below;
  const Wide steps = above / below + (rest >= below - rest ? 1U : 0U);
  if (steps > std::numeric_limits<std::uint64_t>::max()) return std::nullopt;
  return step_of(*shifted, scale, static_cast<std::uint64_t>(steps));
}

}  // namespace spindle::catalogue
