#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "spindle/base/bytes.hpp"
#include "spindle/base/clock.hpp"
#include "spindle/modbus/types.hpp"

namespace spindle::link {

/// Bytes to and from one server, before a deadline. Knows nothing of what they mean.
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
  virtual void set_uninterruptible() = 0;

  /// A request that was given up, and until when its answer may come.
  struct Unanswered {
    modbus::Adu request;
    TimePoint late_until;
  };

  /// Where the stream of a Modbus TCP connection stands between two requests.
  struct Stream {
    Bytes rest = {};       ///< received, and no whole frame yet
    std::size_t torn = 0;  ///< bytes of it that did not come in time
    std::uint16_t first_transaction = 0;
    std::uint16_t next_transaction = 0;
    std::vector<Unanswered> unanswered = {};
    std::optional<Error> out_of_step = std::nullopt;  ///< why the connection is of no use any more
  };

  /// How a line is left to the others of this program who have it, too.
  struct BusLease {
    TimePoint used_until = {};  ///< when the last byte was sent or received
    TimePoint late_until = {};  ///< until when an answer may come that was given up
    std::optional<Stream> stream = std::nullopt;  ///< empty: it has not begun, or there is none
  };

  /// Where others of this program have the same line: waits until none of them awaits an answer,
  /// and keeps them from it until release_bus(). Returns how they left it. A line of one's own is
  /// always free.
  virtual BusLease acquire_bus() { return {}; }
  /// What the next one learns from acquire_bus().
  virtual void release_bus(const BusLease& left) { static_cast<void>(left); }

  /// Another program that has the line open, as far as the system tells: "minicom (process 4711)";
  /// empty when there is none.
  [[nodiscard]] virtual std::string company() const { return {}; }

  /// Until when an answer may come that an earlier program on this line gave up.
  [[nodiscard]] virtual TimePoint late_until() const { return {}; }
  /// What programs that have the line later learn from late_until().
  virtual void leave_late(TimePoint until) { static_cast<void>(until); }

  /// Whether nothing but this program can be on the line.
  [[nodiscard]] virtual bool is_private() const { return false; }

  /// Whether others of this program have it, too, so that it is not for one of them to open anew.
  [[nodiscard]] virtual bool is_shared() const { return false; }
};

}  // namespace spindle::link
