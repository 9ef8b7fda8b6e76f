#pragma once

#include "spindle/base/clock.hpp"
#include "spindle/link/endpoint.hpp"

namespace spindle::link {

/// How a serial line is set. There are always eight data bits.
struct SerialSettings {
  unsigned baud = 9600;
  Parity parity = Parity::even;
  unsigned stop_bits = 1;

  bool operator==(const SerialSettings&) const = default;
};

/// What the endpoint says, and where it says nothing the profile's: rate, parity ('N', 'E' or 'O')
/// and stop bits.
SerialSettings serial_settings(const Endpoint& endpoint, unsigned baud, char parity,
                               unsigned stop_bits);

/// Time of one character on the line: start bit, data, parity and stop bits.
Duration character_time(const SerialSettings& line);

/// Silence between frames (Modbus over Serial Line 1.02, 2.5.1.1): 3.5 characters of 11 bits, above
/// 19200 baud 1.75 ms.
Duration standard_silence(unsigned baud);

}  // namespace spindle::link
