#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "spindle/base/bytes.hpp"
#include "spindle/base/clock.hpp"
#include "spindle/link/line_doubt.hpp"
#include "spindle/modbus/types.hpp"

namespace spindle::link {

struct SessionOptions;

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

  /// Takes set_uninterruptible() back, where several sessions have this transport in turns.
  virtual void set_interruptible() {}

  /// Ends the receive() that another thread waits in, or the next one, as its deadline would. May
  /// be called from any thread. A transport that nothing shares need not be able to.
  virtual void wake() {}

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

  /// Where the dialogue with one unit of a serial line stands between two requests.
  struct Dialogue {
    std::optional<TimePoint> quarantined_until = std::nullopt;
    TimePoint doubtful_until = {};
    TimePoint past_until = {};
    std::optional<modbus::Adu> abandoned = std::nullopt;
    std::vector<Unanswered> unanswered = {};
    LineDoubt doubt = {};
  };

  /// How a line is left to the others of this program who have it, too.
  struct BusLease {
    TimePoint used_until = {};  ///< when the last byte was sent or received
    TimePoint late_until = {};  ///< until when an answer may come that was given up
    std::optional<Stream> stream = std::nullopt;  ///< empty: it has not begun, or there is none
    /// Modbus TCP: what others received since the last turn and was not for them: whole frames.
    /// Only where there is no stream yet, part of a frame may follow.
    Bytes heard = {};
    std::map<modbus::UnitId, Dialogue> dialogues = {};  ///< of all sessions, by unit
  };

  /// Where others of this program have the same line: waits until none of them awaits an answer,
  /// and keeps them from it until release_bus(). Returns how they left it. A line of one's own is
  /// always free.
  virtual BusLease acquire_bus() { return {}; }
  /// What the next one learns from acquire_bus().
  virtual void release_bus(const BusLease& left) { static_cast<void>(left); }
  /// Modbus TCP: gives the others a frame that came in this turn and that nothing had asked for.
  virtual void pass_on(ByteView frame) { static_cast<void>(frame); }
  /// From now on this session's turns come before those of all that are not urgent, and do not wait
  /// for long until one of those is over: for what leaves a tool safe.
  virtual void set_urgent() {}

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

  /// How the session on this transport goes about it, told whenever that changes.
  virtual void introduce(const SessionOptions& options) { static_cast<void>(options); }
  /// From now on answers are believed without a proof behind them; see Session.
  virtual void skip_verification() {}
  /// Whether another program has the line and is asked for everything: in frames of Modbus TCP with
  /// ids, whatever is on the line itself. Silence, late answers and proofs are that program's
  /// affair, and receive() also fails with what it says became of a request.
  [[nodiscard]] virtual bool asks_owner() const { return false; }

  /// What other programs call this line by, the same however it was spelt: "tcp-127.0.0.1-502",
  /// "rtu-/dev/ttyUSB0". Empty where they cannot mean it.
  [[nodiscard]] virtual std::string line_name() const { return {}; }
};

}  // namespace spindle::link
