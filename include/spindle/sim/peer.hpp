#pragma once

#include <cstdint>
#include <deque>
#include <optional>

#include "spindle/base/bytes.hpp"
#include "spindle/modbus/adu.hpp"
#include "spindle/sim/fault_plan.hpp"
#include "spindle/sim/server.hpp"

namespace spindle::sim {

/// Counts answers over all connections of one simulated server, so that faults can name them.
struct AnswerCounter {
  std::uint32_t value = 0;
};

/// The server's end of one connection: bytes in, bytes out at their time, with the faults of a
/// plan. Pure; sockets, ptys and the in-process transport are thin shells around it.
class Peer {
 public:
  Peer(Server& server, ConnectionId connection, modbus::Framing framing, const FaultPlan& faults,
       AnswerCounter& counter);
  ~Peer();
  Peer(const Peer&) = delete;
  Peer& operator=(const Peer&) = delete;

  /// Bytes from the client. Complete requests are answered into the outbox.
  void receive(ByteView bytes, TimePoint now);
  /// An event frame for this client (transaction id counts up from 1 as in the manual's example).
  void push(const modbus::Pdu& pdu, TimePoint now);
  /// When take() will next have bytes; empty when nothing is waiting.
  [[nodiscard]] std::optional<TimePoint> next_due() const;
  /// The next piece that is due, as one segment; empty when there is none.
  Bytes take(TimePoint now);
  /// The plan closed the connection, and everything before that was taken.
  [[nodiscard]] bool closed(TimePoint now) const;

 private:
  struct Piece {
    TimePoint due;
    Bytes bytes;
  };
  void answer(const modbus::Adu& request, TimePoint now);
  void send(Bytes bytes, TimePoint due);

  Server* server_;
  ConnectionId connection_;
  modbus::Framing framing_;
  const FaultPlan* faults_;
  AnswerCounter* counter_;
  Bytes inbox_ = {};
  std::deque<Piece> outbox_ = {};
  Bytes glued_ = {};
  std::uint16_t push_transaction_ = 1;
  std::optional<TimePoint> close_at_ = std::nullopt;
};

}  // namespace spindle::sim
