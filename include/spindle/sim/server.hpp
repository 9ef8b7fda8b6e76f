#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "spindle/base/clock.hpp"
#include "spindle/modbus/types.hpp"

namespace spindle::sim {

/// Tells the clients of one simulated server apart.
struct ConnectionId {
  std::uint32_t value = 0;
  friend auto operator<=>(const ConnectionId&, const ConnectionId&) = default;
};

/// A PDU that the tool sends unasked to one client.
struct Push {
  ConnectionId connection;
  modbus::Pdu pdu;
};

/// A simulated tool as a state machine over time: PDU in, PDU out. It never waits and never reads a
/// clock; the caller says what time it is. Not thread-safe.
class Server {
 public:
  Server() = default;
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;
  virtual ~Server() = default;

  /// The response to one request (normal or exception), or nothing when the tool stays silent.
  /// Calls advance(now) itself.
  virtual std::optional<modbus::Pdu> answer(ConnectionId connection, modbus::UnitId unit,
                                            const modbus::Pdu& request, TimePoint now) = 0;

  /// Whether requests to this unit get answers at all; on a serial line, those to other units and
  /// broadcasts do not.
  [[nodiscard]] virtual bool answers_to(modbus::UnitId unit) const {
    static_cast<void>(unit);
    return true;
  }

  /// The unit identifier of answers to this one; on a network a tool may have its own.
  [[nodiscard]] virtual modbus::UnitId answering_unit(modbus::UnitId asked) const { return asked; }

  /// Silence that a server on a serial line wants before a query; it does not hear one that comes
  /// earlier. Zero on a network.
  [[nodiscard]] virtual Duration required_gap() const { return {}; }

  /// Time that a server on a serial line lets pass between a query and its answer, the gap not
  /// counted. Zero on a network.
  [[nodiscard]] virtual Duration answer_delay(modbus::UnitId unit) const {
    static_cast<void>(unit);
    return {};
  }

  /// Bytes on the serial line that were no frame: a bad checksum, a torn frame, noise.
  virtual void bad_frame(TimePoint now) { static_cast<void>(now); }

  /// Lets time pass: motion, torque, expiring output, operators.
  virtual void advance(TimePoint now) = 0;

  /// When something will next happen by itself, always later than the last advance(); empty when
  /// nothing is due.
  [[nodiscard]] virtual std::optional<TimePoint> next_change() const = 0;

  /// Frames that became due since the last call, oldest first.
  virtual std::vector<Push> take_pushes() = 0;

  /// The same for one client only; those of others stay.
  virtual std::vector<Push> take_pushes(ConnectionId connection) {
    static_cast<void>(connection);
    return {};
  }

  /// What the tool would push now: the last event. Empty when it is of a kind that never pushes.
  [[nodiscard]] virtual std::optional<modbus::Pdu> event_frame() const { return std::nullopt; }

  /// Power off and on: what is not stored is forgotten. Connections are the driver's business.
  virtual void reboot(TimePoint now) { advance(now); }

  virtual void connected(ConnectionId connection) = 0;
  virtual void disconnected(ConnectionId connection) = 0;
};

}  // namespace spindle::sim
