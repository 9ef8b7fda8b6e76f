#pragma once

#include <compare>
#include <cstdint>
#include <optional>
#include <span>

#include "spindle/base/bytes.hpp"
#include "spindle/base/decimal.hpp"
#include "spindle/base/enum_table.hpp"
#include "spindle/base/error.hpp"

namespace spindle::catalogue {

/// What the bits of registers mean.
enum class Kind : std::uint8_t {
  u16,
  i16,
  u32,
  i32,
  u64,
  i64,
  u8,    ///< one half of a register
  i8,    ///< likewise
  f32,   ///< IEEE 754 binary32
  f64,   ///< IEEE 754 binary64
  bcd,   ///< binary coded decimal, two digits a byte
  text,  ///< characters
  bit,   ///< a coil or a discrete input, or some bits of a register
  date,  ///< a date and a time of day
};
/// As written in profiles and raw registers.
inline constexpr auto kind_words = enum_table<Kind>({{"u16", Kind::u16},
                                                     {"i16", Kind::i16},
                                                     {"u32", Kind::u32},
                                                     {"i32", Kind::i32},
                                                     {"u64", Kind::u64},
                                                     {"i64", Kind::i64},
                                                     {"u8", Kind::u8},
                                                     {"i8", Kind::i8},
                                                     {"f32", Kind::f32},
                                                     {"f64", Kind::f64},
                                                     {"bcd", Kind::bcd},
                                                     {"text", Kind::text},
                                                     {"bit", Kind::bit},
                                                     {"date", Kind::date}});

/// Of the registers of one value: whether the first has the high or the low word.
enum class WordOrder : std::uint8_t { big, little };
inline constexpr auto word_order_words =
    enum_table<WordOrder>({{"big", WordOrder::big}, {"little", WordOrder::little}});

/// Of the bytes of one register: whether the high or the low one comes first.
enum class ByteOrder : std::uint8_t { big, little };
inline constexpr auto byte_order_words =
    enum_table<ByteOrder>({{"big", ByteOrder::big}, {"little", ByteOrder::little}});

/// What a text is filled up with.
enum class Padding : std::uint8_t { nul, space };
inline constexpr auto padding_words =
    enum_table<Padding>({{"nul", Padding::nul}, {"space", Padding::space}});

/// How the characters of a text stand in registers.
enum class Packing : std::uint8_t {
  two,  ///< two bytes a register
  low,  ///< one byte a register, in its low half
};
inline constexpr auto packing_words =
    enum_table<Packing>({{"two", Packing::two}, {"low", Packing::low}});

/// How the parts of a date stand in registers.
enum class DateLayout : std::uint8_t {
  registers,       ///< six registers: year (of this century), month, day, hour, minute, second
  long_year,       ///< the same with all four digits of the year
  bytes,           ///< the same six as bytes of three registers
  year_and_bytes,  ///< all four digits of the year, then bytes: the other five, and one that is not
                   ///< ours
  unix_time,       ///< seconds since 1970-01-01 00:00 UTC, in two registers
};
inline constexpr auto date_layout_words =
    enum_table<DateLayout>({{"registers", DateLayout::registers},
                            {"long-year", DateLayout::long_year},
                            {"bytes", DateLayout::bytes},
                            {"year-and-bytes", DateLayout::year_and_bytes},
                            {"unix", DateLayout::unix_time}});

/// Bits of an integer, counted from the lowest. Width 0: all of it.
struct BitSlice {
  std::uint8_t first = 0;
  std::uint8_t width = 0;
  [[nodiscard]] constexpr bool is_whole() const { return width == 0; }
  friend bool operator==(const BitSlice&, const BitSlice&) = default;
};

/// How registers become a value: an integer of `kind` times `scale` / `divisor`, plus `offset`; or
/// a floating-point number, digits, characters, a date.
struct Encoding {
  Kind kind = Kind::u16;
  Decimal scale = Decimal(1);
  std::uint32_t divisor = 1;  ///< of `scale`: 20/32768
  Decimal offset = Decimal(0);
  /// So many are shown of a number; empty: as many as are exact.
  std::optional<std::uint8_t> decimals = std::nullopt;
  std::uint16_t length = 0;  ///< bytes of a text or of BCD digits
  std::uint16_t count = 1;   ///< values of this kind, one behind the other
  BitSlice slice = {};       ///< which bits of the integer count; the others are not ours
  WordOrder word_order = WordOrder::big;
  ByteOrder byte_order = ByteOrder::big;
  Padding padding = Padding::nul;
  Packing packing = Packing::two;
  DateLayout date = DateLayout::registers;

  /// Whether values are numbers that scale and offset apply to.
  [[nodiscard]] bool is_integer() const;
  [[nodiscard]] bool is_float() const { return kind == Kind::f32 || kind == Kind::f64; }
  /// Whether registers hold bits that are no part of the value, so that a write needs what they
  /// hold now.
  [[nodiscard]] bool is_part() const { return !slice.is_whole(); }
};

/// 16-bit registers (coils and discrete inputs: bits) of one value, of all its elements.
std::uint16_t register_count(const Encoding& encoding);

/// Smallest and largest integer that the kind, and the bits of it that count, can hold. Requires
/// is_integer() or BCD.
Decimal lowest(const Encoding& encoding);
Decimal highest(const Encoding& encoding);

/// What one step of the integer is worth, as people read it: "0.01", "20/32768".
std::string step_in_words(const Encoding& encoding);

/// The registers of one element as one integer, in the order that the encoding says. Requires
/// 1 to 4 registers.
std::uint64_t to_pattern(const Encoding& encoding, RegisterView registers);
/// The other way round: `present` is what they hold now, as to_pattern() gives it; its bits outside
/// the slice stay.
Registers to_registers(const Encoding& encoding, std::uint64_t pattern, std::uint64_t present = 0);
/// The same where the registers are: their bits outside the slice stay. Requires those of one
/// element.
void put_pattern(const Encoding& encoding, std::uint64_t pattern,
                 std::span<std::uint16_t> registers);

/// An integer of 64 bits, with or without a sign.
struct Integer {
  Sign sign = Sign::plus;
  std::uint64_t magnitude = 0;  ///< zero has no sign

  friend constexpr bool operator==(const Integer&, const Integer&) = default;
  friend constexpr std::strong_ordering operator<=>(const Integer& a, const Integer& b) {
    if (a.sign != b.sign) return b.sign <=> a.sign;
    return a.sign == Sign::plus ? a.magnitude <=> b.magnitude : b.magnitude <=> a.magnitude;
  }
};
/// The bits of the slice, as the kind means them.
Integer to_integer(const Encoding& encoding, std::uint64_t pattern);
/// The other way round. Requires an integer that fits.
std::uint64_t to_pattern(const Encoding& encoding, const Integer& integer);

/// What is stored times scale and plus offset; rounded where the divisor leaves no end of decimals,
/// or the offset more than fit and only some of them are shown. Empty when it does not fit a
/// Decimal.
std::optional<Decimal> scaled(const Encoding& encoding, const Decimal& stored);

/// The integer whose scaled value is nearest, a half away from zero. Empty when it does not fit 64
/// bits.
std::optional<Integer> nearest_step(const Encoding& encoding, const Decimal& number);

/// What has to be stored for this number, with as many digits as fit: the other way round from
/// scaled(). Empty when it does not fit.
std::optional<Decimal> unscaled(const Encoding& encoding, const Decimal& number);

}  // namespace spindle::catalogue
