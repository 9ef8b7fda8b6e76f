#include "codec.hpp"

#include <fmt/format.h>

#include <array>
#include <bit>
#include <charconv>
#include <chrono>
#include <cmath>
#include <limits>

#include "spindle/base/text.hpp"

namespace spindle::catalogue {
namespace {

constexpr unsigned bits_per_byte = 8;
constexpr unsigned bits_per_digit = 4;
constexpr std::uint16_t low_byte = 0xFF;
constexpr int century = 2000;
constexpr int years_in_century = 100;

template <typename Float>
FloatNumber shortest(Float value) {
  if (std::isnan(value)) return {std::nullopt, "NaN"};
  if (std::isinf(value)) return {std::nullopt, value < 0 ? "-inf" : "inf"};
  std::array<char, 32> text = {};
  const auto end =
      std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::scientific);
  auto number = parse_scientific({text.data(), end.ptr});
  // Digits that stand before the point are no decimals: 1e3 is 1000.
  if (number && number->exponent() > 0) {
    if (const auto plain = number->times(Decimal(1))) number = plain;
  }
  return {number};
}

template <typename Float>
std::optional<Float> parse_float(const Decimal& number) {
  const std::string text = fmt::format("{}{}e{}", number.sign() == Sign::minus ? "-" : "",
                                       number.magnitude(), number.exponent());
  Float value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error == std::errc::result_out_of_range) {
    // Too small is 0; too large is nothing.
    const bool is_small = number.magnitude() == 0 || number < Decimal(1, 0);
    const bool is_above = number > Decimal(-1, 0);
    if (is_small && is_above) return Float{0};
    return std::nullopt;
  }
  if (error != std::errc() || std::isinf(value)) return std::nullopt;
  return value;
}

Bytes bytes_of(const Encoding& encoding, RegisterView registers) {
  Bytes bytes;
  for (const std::uint16_t word : registers) {
    const auto high = static_cast<std::uint8_t>(word >> bits_per_byte);
    const auto low = static_cast<std::uint8_t>(word & low_byte);
    if (encoding.packing == Packing::low) {
      bytes.push_back(low);
    } else if (encoding.byte_order == ByteOrder::big) {
      bytes.insert(bytes.end(), {high, low});
    } else {
      bytes.insert(bytes.end(), {low, high});
    }
  }
  return bytes;
}

Registers words_of(const Encoding& encoding, const Bytes& bytes) {
  Registers words;
  if (encoding.packing == Packing::low) {
    words.assign(bytes.begin(), bytes.end());
    return words;
  }
  for (std::size_t i = 0; i + 1 < bytes.size(); i += 2) {
    const bool is_big = encoding.byte_order == ByteOrder::big;
    const unsigned high = bytes[is_big ? i : i + 1];
    const unsigned low = bytes[is_big ? i + 1 : i];
    words.push_back(static_cast<std::uint16_t>((high << bits_per_byte) | low));
  }
  return words;
}

/// Year, month, day, hour, minute, second.
using DateParts = std::array<unsigned, 6>;

bool is_date(const DateParts& parts) {
  using namespace std::chrono;
  const year_month_day day(year(static_cast<int>(parts[0])), month(parts[1]),
                           std::chrono::day(parts[2]));
  constexpr unsigned hours = 24;
  constexpr unsigned minutes = 60;
  return parts[0] <= 9999 && day.ok() && parts[3] < hours && parts[4] < minutes &&
         parts[5] < minutes;
}

std::string date_in_words(const DateParts& p) {
  return fmt::format("{:04}-{:02}-{:02} {:02}:{:02}:{:02}", p[0], p[1], p[2], p[3], p[4], p[5]);
}

/// A year without its century.
unsigned whole_year(unsigned year) { return year < years_in_century ? year + century : year; }

std::string unix_date(std::uint64_t seconds) {
  using namespace std::chrono;
  const sys_seconds time{std::chrono::seconds(static_cast<std::int64_t>(seconds))};
  const sys_days day = floor<days>(time);
  const year_month_day date(day);
  const hh_mm_ss clock(time - day);
  return date_in_words({static_cast<unsigned>(static_cast<int>(date.year())),
                        static_cast<unsigned>(date.month()), static_cast<unsigned>(date.day()),
                        static_cast<unsigned>(clock.hours().count()),
                        static_cast<unsigned>(clock.minutes().count()),
                        static_cast<unsigned>(clock.seconds().count())});
}

std::optional<DateParts> parse_date(std::string_view text) {
  constexpr std::size_t day_only = 10;
  constexpr std::size_t whole = 19;
  constexpr std::string_view form = "0000-00-00 00:00:00";
  if (text.size() != day_only && text.size() != whole) return std::nullopt;
  DateParts parts = {};
  std::size_t part = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool is_digit = text[i] >= '0' && text[i] <= '9';
    if (is_digit != (form[i] == '0')) return std::nullopt;
    if (is_digit) {
      parts[part] = parts[part] * 10 + static_cast<unsigned>(text[i] - '0');
      continue;
    }
    if (text[i] != form[i] && !(i == day_only && text[i] == 'T')) return std::nullopt;
    ++part;
  }
  if (!is_date(parts)) return std::nullopt;
  return parts;
}

}  // namespace

std::optional<Decimal> parse_scientific(std::string_view text) {
  constexpr int steepest = 400;
  const std::size_t at = text.find_first_of("eE");
  const auto digits = Decimal::parse(text.substr(0, at));
  if (!digits || at == std::string_view::npos) return digits;
  int exponent = 0;
  std::string_view power = text.substr(at + 1);
  if (power.starts_with('+')) power.remove_prefix(1);
  const auto [end, error] = std::from_chars(power.data(), power.data() + power.size(), exponent);
  if (error != std::errc() || end != power.data() + power.size()) return std::nullopt;
  if (exponent > steepest || exponent < -steepest) return std::nullopt;
  return Decimal(digits->sign(), digits->magnitude(), digits->exponent() + exponent);
}

FloatNumber float_of(Kind kind, std::uint64_t pattern) {
  if (kind == Kind::f64) return shortest(std::bit_cast<double>(pattern));
  return shortest(std::bit_cast<float>(static_cast<std::uint32_t>(pattern)));
}

std::optional<std::uint64_t> float_pattern(Kind kind, const Decimal& number) {
  if (kind == Kind::f64) {
    const auto value = parse_float<double>(number);
    if (!value) return std::nullopt;
    return std::bit_cast<std::uint64_t>(*value);
  }
  const auto value = parse_float<float>(number);
  if (!value) return std::nullopt;
  return std::bit_cast<std::uint32_t>(*value);
}

std::optional<std::uint64_t> bcd_number(std::uint64_t pattern) {
  constexpr std::uint64_t digit = 0xF;
  std::uint64_t number = 0;
  for (int shift = std::numeric_limits<std::uint64_t>::digits - int{bits_per_digit}; shift >= 0;
       shift -= int{bits_per_digit}) {
    const std::uint64_t one = (pattern >> static_cast<unsigned>(shift)) & digit;
    if (one > 9) return std::nullopt;
    number = number * 10 + one;
  }
  return number;
}

std::uint64_t bcd_pattern(std::uint64_t number) {
  std::uint64_t pattern = 0;
  for (unsigned shift = 0; number != 0; shift += bits_per_digit) {
    pattern |= (number % 10) << shift;
    number /= 10;
  }
  return pattern;
}

std::string text_of(const Encoding& encoding, RegisterView registers) {
  const Bytes bytes = bytes_of(encoding, registers);
  std::string text(bytes.begin(), bytes.end());
  text.resize(std::min<std::size_t>(text.size(), encoding.length));
  // What stands behind the end is what was there before.
  if (const std::size_t end = text.find('\0'); end != std::string::npos) text.resize(end);
  if (encoding.padding == Padding::space) {
    const std::size_t last = text.find_last_not_of(' ');
    text.resize(last == std::string::npos ? 0 : last + 1);
  }
  return text;
}

std::optional<Registers> text_registers(const Encoding& encoding, std::string_view text) {
  if (text.size() > encoding.length) return std::nullopt;
  Bytes bytes(text.begin(), text.end());
  const std::size_t per_register = encoding.packing == Packing::low ? 1 : 2;
  bytes.resize(per_register * ((encoding.length + per_register - 1) / per_register),
               encoding.padding == Padding::space ? ' ' : 0);
  return words_of(encoding, bytes);
}

namespace {

/// The year in a register of its own, the others in bytes behind it.
std::optional<std::string> date_of_year_and_bytes(const Encoding& encoding,
                                                  RegisterView registers) {
  const Bytes bytes = bytes_of(encoding, registers.subspan(1));
  DateParts parts = {registers.front()};
  for (std::size_t i = 1; i < parts.size(); ++i) parts[i] = bytes[i - 1];
  if (parts == DateParts()) return std::string();
  if (parts[0] == 0 || !is_date(parts)) return std::nullopt;
  return date_in_words(parts);
}

}  // namespace

std::optional<std::string> date_of(const Encoding& encoding, RegisterView registers) {
  if (encoding.date == DateLayout::year_and_bytes) {
    return date_of_year_and_bytes(encoding, registers);
  }
  if (std::all_of(registers.begin(), registers.end(), [](auto word) { return word == 0; })) {
    return std::string();
  }
  if (encoding.date == DateLayout::unix_time) return unix_date(to_pattern(encoding, registers));
  DateParts parts = {};
  const bool in_bytes = encoding.date == DateLayout::bytes;
  const Bytes bytes = in_bytes ? bytes_of(encoding, registers) : Bytes();
  for (std::size_t i = 0; i < parts.size(); ++i) parts[i] = in_bytes ? bytes[i] : registers[i];
  parts[0] = whole_year(parts[0]);
  if (!is_date(parts)) return std::nullopt;
  return date_in_words(parts);
}

std::optional<Registers> date_registers(const Encoding& encoding, std::string_view text) {
  const auto parts = parse_date(text);
  if (!parts) return std::nullopt;
  const auto& [year, month, day, hour, minute, second] = *parts;
  if (encoding.date == DateLayout::unix_time) {
    using namespace std::chrono;
    const sys_days days(year_month_day(std::chrono::year(static_cast<int>(year)),
                                       std::chrono::month(month), std::chrono::day(day)));
    const auto time = days + hours(hour) + minutes(minute) + seconds(second);
    const auto count = time.time_since_epoch().count();
    if (count < 0 || count > std::numeric_limits<std::uint32_t>::max()) return std::nullopt;
    return to_registers(encoding, static_cast<std::uint64_t>(count));
  }
  const bool is_mixed = encoding.date == DateLayout::year_and_bytes;
  const bool is_long = is_mixed || encoding.date == DateLayout::long_year;
  const bool has_century = year >= century && year < century + years_in_century;
  if (!has_century && !is_long) return std::nullopt;
  const unsigned short_year = is_long ? year : year - century;
  if (is_mixed) {
    Registers mixed =
        words_of(encoding, {static_cast<std::uint8_t>(month), static_cast<std::uint8_t>(day),
                            static_cast<std::uint8_t>(hour), static_cast<std::uint8_t>(minute),
                            static_cast<std::uint8_t>(second), 0});
    mixed.insert(mixed.begin(), static_cast<std::uint16_t>(year));
    return mixed;
  }
  if (encoding.date != DateLayout::bytes) {
    return Registers{static_cast<std::uint16_t>(short_year), static_cast<std::uint16_t>(month),
                     static_cast<std::uint16_t>(day),        static_cast<std::uint16_t>(hour),
                     static_cast<std::uint16_t>(minute),     static_cast<std::uint16_t>(second)};
  }
  return words_of(encoding,
                  {static_cast<std::uint8_t>(short_year), static_cast<std::uint8_t>(month),
                   static_cast<std::uint8_t>(day), static_cast<std::uint8_t>(hour),
                   static_cast<std::uint8_t>(minute), static_cast<std::uint8_t>(second)});
}

}  // namespace spindle::catalogue
