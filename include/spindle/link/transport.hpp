#pragma once

#include <span>

#include "spindle/base/bytes.hpp"
#include "spindle/base/clock.hpp"

namespace spindle::link {

/// Bytes to and from one server, before a deadline. Knows nothing of Modbus.
class Transport {
 public:
  Transport() = default;
  Transport(const Transport&) = delete;
  Transport& operator=(const Transport&) = delete;
  virtual ~Transport() = default;

  /// Sends all bytes, or fails: `closed`, `reset`, `no_answer` (the peer took no more before the
  /// deadline), `interrupted`, `terminated`.
  virtual Result<void> send(ByteView bytes, TimePoint deadline) = 0;

  /// Waits until at least one byte is there and returns how many were stored; 0 only at the
  /// deadline. Bytes that are already there are returned even when the deadline has passed. Fails
  /// with `closed`, `reset`, `interrupted` or `terminated`.
  virtual Result<std::size_t> receive(std::span<std::uint8_t> into, TimePoint deadline) = 0;

  /// From now on an interrupt no longer ends a wait: for the last words that leave a tool safe
  /// (disarm, stop).
  virtual void shield() = 0;

  /// Where others of this program have the same line: waits until none of them awaits an answer,
  /// and keeps them from it until end_turn(). Returns when they used it last. A line of one's own
  /// is always free.
  virtual TimePoint begin_turn() { return {}; }
  /// `used_until` is what the next one learns from begin_turn().
  virtual void end_turn(TimePoint used_until) { static_cast<void>(used_until); }
};

}  // namespace spindle::link
