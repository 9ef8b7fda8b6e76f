#pragma once

#include <string_view>

#include "spindle/base/bytes.hpp"

namespace spindle::test {

/// The bytes of "01 03 0480": hexadecimal digits, spaces anywhere.
inline Bytes hex(std::string_view text) {
  constexpr std::string_view digits = "0123456789ABCDEF";
  Bytes bytes;
  unsigned nibbles = 0;
  for (const char c : text) {
    const std::size_t digit = digits.find(c);
    if (digit == std::string_view::npos) continue;
    if (nibbles++ % 2 == 0) bytes.push_back(0);
    bytes.back() = static_cast<std::uint8_t>(bytes.back() * 16U + digit);
  }
  return bytes;
}

}  // namespace spindle::test
