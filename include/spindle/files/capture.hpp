#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "spindle/base/bytes.hpp"
#include "spindle/base/clock.hpp"
#include "spindle/modbus/adu.hpp"

namespace spindle::files {

/// Who sent a captured frame.
enum class Sender : std::uint8_t { client, server };

/// One frame as it was on the wire, or bytes that are none.
struct CapturedFrame {
  Sender sender = Sender::client;
  modbus::Framing framing = modbus::Framing::tcp;
  WallTime time = {};
  std::string_view target = {};  ///< kept as a comment of the packet
  ByteView bytes = {};
};

/// The beginning of a pcapng file (IETF draft-ietf-opsawg-pcapng: section header and one interface)
/// of Wireshark's "upper PDU" packets, whose dissector is named in each: Modbus/TCP or Modbus RTU,
/// whatever port or serial line it was.
std::string capture_head();

/// The block of one frame, to be appended. Clients have port 40000 and servers port 502 there, by
/// which Wireshark tells requests from responses; the true address is in the comment.
std::string capture_block(const CapturedFrame& frame);

}  // namespace spindle::files
