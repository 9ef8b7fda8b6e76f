#pragma once

#include "spindle/base/bytes.hpp"

namespace spindle::modbus {

/// CRC-16 of Modbus over Serial Line 1.02, 6.2.2: start FFFFh, reflected polynomial A001h.
/// It is sent with its low byte first. Check: bytes 02 07 give 1241h.
std::uint16_t crc16(ByteView bytes);

}  // namespace spindle::modbus
