#include "spindle/modbus/crc16.hpp"

#include <array>

namespace spindle::modbus {
namespace {

constexpr std::array<std::uint16_t, 256> make_table() {
  constexpr unsigned polynomial = 0xA001;
  std::array<std::uint16_t, 256> table{};
  for (unsigned byte = 0; byte < table.size(); ++byte) {
    unsigned remainder = byte;
    for (int bit = 0; bit < 8; ++bit) {
      remainder = (remainder & 1U) != 0 ? (remainder >> 1U) ^ polynomial : remainder >> 1U;
    }
    table[byte] = static_cast<std::uint16_t>(remainder);
  }
  return table;
}

constexpr auto table = make_table();

}  // namespace

std::uint16_t crc16(ByteView bytes) {
  std::uint16_t crc = 0xFFFF;
  for (const std::uint8_t byte : bytes) {
    crc = static_cast<std::uint16_t>((crc >> 8U) ^ table[(crc ^ byte) & 0xFFU]);
  }
  return crc;
}

}  // namespace spindle::modbus
