#pragma once

#include <optional>
#include <string>
#include <variant>

#include "spindle/modbus/types.hpp"

namespace spindle::modbus {

/// MBAP header (Modbus Messaging on TCP/IP 1.0b, 3.1.3), or unit and CRC (Modbus over Serial
/// Line 1.02, 2.5.1).
enum class Framing : std::uint8_t { tcp, rtu };

/// Whose incoming bytes these are. A client receives responses, a server requests: on RTU the
/// length of a frame follows from its function only when that is known.
enum class Role : std::uint8_t { client, server };

/// One complete frame at the front of the buffer.
struct Deframed {
  Adu adu;
  std::size_t consumed = 0;    ///< bytes to remove from the front, noise included
  std::size_t skipped = 0;     ///< bytes of noise before the frame (RTU)
  std::uint16_t protocol = 0;  ///< MBAP protocol identifier as received; some tools put an id in it
};

/// So far nothing complete, and nothing impossible.
struct NeedMore {};

/// The bytes cannot become a frame. On TCP the stream has lost its boundaries: reconnect.
/// On RTU `size` bytes are noise and may be dropped.
struct Junk {
  std::size_t size = 0;
  std::string reason;
};

using Deframing = std::variant<Deframed, NeedMore, Junk>;

/// The bytes of one ADU. RTU ignores the transaction id.
Bytes frame(Framing framing, const Adu& adu);

/// Looks for one frame at the front of `buffered`; pure, so it may be called again with more bytes.
/// TCP: an MBAP length outside 2…254, or a protocol identifier with a high byte, is Junk. What a
/// server sends may be longer, up to max_long_adu_size, where is_counted_by_words() and the length
/// in front of its data is that of the data. RTU: scans for the first frame whose length (by
/// function) is complete and whose CRC fits; bytes before it are `skipped`. Waiting for silence is
/// never needed. With nothing found in more than 256 bytes of buffer, Junk.
Deframing deframe(Framing framing, Role role, ByteView buffered);

/// The RTU frame that these bytes are, whatever its function, for a receiver whose silence told it
/// where frames begin and end. Empty when the CRC does not fit.
std::optional<Adu> whole_rtu_frame(ByteView bytes);

/// The largest frame of the standard: 260 bytes on TCP, 256 on RTU.
inline constexpr std::size_t max_adu_size = 260;

/// The largest frame on TCP whose data begin with their own length: a little more than an event
/// with two curves of 2000 samples each.
inline constexpr std::size_t max_long_adu_size = 16'384;

}  // namespace spindle::modbus
