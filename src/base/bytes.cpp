#include "spindle/base/bytes.hpp"

#include <string_view>

namespace spindle {
namespace {

void append_hex(std::string& text, std::uint8_t byte) {
  constexpr std::string_view digits = "0123456789ABCDEF";
  text += digits[byte >> 4U];
  text += digits[byte & 0x0FU];
}

}  // namespace

void put_u16(Bytes& bytes, std::uint16_t value) {
  bytes.push_back(static_cast<std::uint8_t>(value >> 8U));
  bytes.push_back(static_cast<std::uint8_t>(value & 0xFFU));
}

std::uint16_t get_u16(ByteView bytes, std::size_t offset) {
  return static_cast<std::uint16_t>((bytes[offset] << 8U) | bytes[offset + 1]);
}

std::string to_hex(ByteView bytes) {
  std::string text;
  text.reserve(bytes.size() * 3);
  for (const std::uint8_t byte : bytes) {
    if (!text.empty()) text += ' ';
    append_hex(text, byte);
  }
  return text;
}

std::string to_compact_hex(ByteView bytes) {
  std::string text;
  text.reserve(bytes.size() * 2);
  for (const std::uint8_t byte : bytes) append_hex(text, byte);
  return text;
}

}  // namespace spindle
