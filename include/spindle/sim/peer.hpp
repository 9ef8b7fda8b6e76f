#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <string_view>

#include "spindle/base/bytes.hpp"
#include "spindle/modbus/adu.hpp"
#include "spindle/sim/fault_plan.hpp"
#include "spindle/sim/serial_line.hpp"
#include "spindle/sim/server.hpp"

namespace spindle::sim {

/// Counts answers over all connections of one simulated server, so that faults can name them.
struct AnswerCounter {
  std::uint32_t value = 0;
};

/// The server's end of one connection: bytes in, bytes out at their time, with the faults of a
/// plan. Pure; sockets, ptys and the in-process transport are thin shells around it. Tells the
/// server that the client has come and, when destroyed, gone.
class Peer {
 public:
  /// `server`, `faults` and `counter` must outlive the peer.
  Peer(Server& server, ConnectionId connection, modbus::Framing framing, const FaultPlan& faults,
       AnswerCounter& counter, const LineModel& line = {});
  ~Peer();
  Peer(const Peer&) = delete;
  Peer& operator=(const Peer&) = delete;

  /// Hears of bytes from the client that are not answered, and why ("2.1 ms of silence, 5.5 ms
  /// needed"). Broadcasts are not among them.
  using Ignored = std::function<void(ByteView bytes, std::string_view reason)>;
  void set_ignored(Ignored ignored) { ignored_ = std::move(ignored); }

  /// The tool was switched off: what was heard and not answered yet is forgotten, and what was to
  /// be sent.
  void forget();

  /// Bytes from the client. Complete requests are answered into the outbox. Bytes that cannot be a
  /// frame close the connection on TCP; on RTU the server hears of them (`bad_frame`) and no client
  /// answers. Where the server wants a gap, a query is complete when the line is silent again, and
  /// what begins within the gap is not heard.
  void receive(ByteView bytes, TimePoint now);
  /// An event frame for this client (transaction id counts up from 1 as in the manual's example).
  void push(const modbus::Pdu& pdu, TimePoint now);
  /// When take() will next have bytes, or the connection ends; empty when nothing is waiting.
  [[nodiscard]] std::optional<TimePoint> next_due() const;
  /// The next piece that is due, as one segment; empty when there is none.
  Bytes take(TimePoint now);
  /// The connection has ended, and everything before that was taken.
  [[nodiscard]] bool closed(TimePoint now) const;

 private:
  enum class Ending : std::uint8_t { stay, close };
  enum class Holding : std::uint8_t { none, until_next };

  /// Bytes that no other frame may come between, in pieces 1 ms apart from `due` on.
  struct Message {
    TimePoint due = {};
    std::deque<Bytes> pieces = {};
    Ending ending = Ending::stay;
    Holding holding = Holding::none;
    bool begun = false;
    Duration distance = std::chrono::milliseconds(1);  ///< from one piece to the next
  };

  void echo(ByteView bytes, TimePoint now);
  void ignore(ByteView bytes, std::string_view reason) const;
  void no_frame(ByteView bytes, TimePoint now);
  bool take_request(TimePoint now);
  void take_burst(TimePoint now);
  void answer(const modbus::Adu& request, TimePoint heard, TimePoint now);
  [[nodiscard]] Duration time_on_the_wire(std::size_t bytes) const;
  std::optional<modbus::Pdu> respond(const modbus::Adu& request, const Fault* exception,
                                     TimePoint now);
  Bytes event_bytes(const Fault* fault, modbus::TransactionId pending);
  void disconnect(TimePoint now);
  void enqueue(Message message);
  void join_held(Message& message);

  Server* server_;
  ConnectionId connection_;
  modbus::Framing framing_;
  const FaultPlan* faults_;
  AnswerCounter* counter_;
  Duration character_time_;
  std::optional<SerialLine> line_ = std::nullopt;  ///< where the server wants a gap
  Bytes inbox_ = {};
  TimePoint last_byte_ = {};  ///< in the inbox
  std::deque<Message> outbox_ = {};
  TimePoint pushes_in_order_from_ = {};
  TimePoint in_order_from_ = TimePoint::min();
  std::uint16_t push_transaction_ = 1;
  modbus::UnitId unit_ = {};
  Ignored ignored_ = {};
  bool closing_ = false;  ///< nothing more is read
};

}  // namespace spindle::sim
