#pragma once

#include <cstdint>

#include "spindle/base/clock.hpp"
#include "spindle/base/enum_table.hpp"

namespace spindle::modbus {

enum class Parity : std::uint8_t { none, even, odd };
/// As written in profiles and URLs.
inline constexpr auto parity_words =
    enum_table<Parity>({{"none", Parity::none}, {"even", Parity::even}, {"odd", Parity::odd}});

/// How a serial line is set. There are always eight data bits.
struct SerialSettings {
  unsigned baud = 9600;
  Parity parity = Parity::even;
  unsigned stop_bits = 1;

  bool operator==(const SerialSettings&) const = default;
};

/// Time of one character on the line: start bit, data, parity and stop bits.
Duration character_time(const SerialSettings& line);

/// Silence between frames (Modbus over Serial Line 1.02, 2.5.1.1): 3.5 characters of 11 bits, above
/// 19200 baud 1.75 ms.
Duration standard_silence(unsigned baud);

}  // namespace spindle::modbus
