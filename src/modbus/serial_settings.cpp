#include "spindle/modbus/serial_settings.hpp"

namespace spindle::modbus {
namespace {

constexpr unsigned start_and_data_bits = 9;
constexpr unsigned standard_character_bits = 11;
constexpr unsigned twice_the_characters = 7;
constexpr unsigned last_computed_baud = 19200;
constexpr Duration fixed_silence = std::chrono::microseconds(1750);

Duration time_of_bits(unsigned bits, unsigned baud) {
  return Duration(std::chrono::seconds(bits)) / baud;
}

}  // namespace

Duration character_time(const SerialSettings& line) {
  const unsigned parity_bits = line.parity == Parity::none ? 0 : 1;
  return time_of_bits(start_and_data_bits + parity_bits + line.stop_bits, line.baud);
}

Duration standard_silence(unsigned baud) {
  if (baud > last_computed_baud) return fixed_silence;
  return time_of_bits(standard_character_bits * twice_the_characters, baud) / 2;
}

}  // namespace spindle::modbus
