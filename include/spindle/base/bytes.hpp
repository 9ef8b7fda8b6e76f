#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace spindle {

using Bytes = std::vector<std::uint8_t>;
using ByteView = std::span<const std::uint8_t>;

/// 16-bit Modbus registers in the order in which they are sent.
using Registers = std::vector<std::uint16_t>;
using RegisterView = std::span<const std::uint16_t>;

/// Appends `value` with its high byte first, as Modbus sends every 16-bit item
/// (Modbus Application Protocol 1.1b3, section 4.2).
void put_u16(Bytes& bytes, std::uint16_t value);

/// The big-endian 16-bit item at `offset`. Requires `offset + 2 <= bytes.size()`.
std::uint16_t get_u16(ByteView bytes, std::size_t offset);

/// "00 1F A0": two upper-case digits a byte, separated by single spaces.
std::string to_hex(ByteView bytes);

/// "001FA0": the same without separators.
std::string to_compact_hex(ByteView bytes);

}  // namespace spindle
