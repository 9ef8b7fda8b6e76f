#pragma once

#include <cstdint>
#include <optional>

#include "posix/descriptor.hpp"
#include "spindle/posix/serve.hpp"
#include "spindle/sim/peer.hpp"

namespace spindle::posix {

/// What all clients of one served tool share.
struct Service {
  sim::Server& server;
  const ServeOptions& options;
  sim::AnswerCounter answers = {};
};

/// One connection to a simulated tool: carries bytes between a non-blocking descriptor and a
/// sim::Peer, and ends both directions in good order. A serial line has no order to end in: it is
/// there or gone.
class ServedClient {
 public:
  /// What the descriptor is.
  enum class Wire : std::uint8_t { socket, terminal };

  ServedClient(Descriptor descriptor, Wire wire, sim::ConnectionId connection, Service& service);
  ~ServedClient();
  ServedClient(const ServedClient&) = delete;
  ServedClient& operator=(const ServedClient&) = delete;

  [[nodiscard]] int descriptor() const { return descriptor_.number(); }
  /// What to poll for now.
  [[nodiscard]] short events() const;
  /// When write() or finished() will have news without the client's doing.
  [[nodiscard]] std::optional<TimePoint> wake_at() const;

  /// Takes what the client sent; for POLLIN, POLLHUP and POLLERR.
  void read(TimePoint now);
  /// Queues an event frame.
  void push(const modbus::Pdu& pdu, TimePoint now);
  /// Whatever is under way in either direction is lost.
  void forget();
  /// Sends what is due, as far as the client takes it.
  void write(TimePoint now);
  /// Both directions have ended, or the client is gone, too slow, or lingers for too long.
  [[nodiscard]] bool finished(TimePoint now) const;

 private:
  enum class Half : std::uint8_t { open, ended };

  void flush();
  void discard_input() const;
  void end_input(TimePoint now);
  void end_output(TimePoint now);
  void hear(sim::Heard heard, ByteView bytes) const;
  [[nodiscard]] bool at_another_rate() const;

  Descriptor descriptor_;
  Wire wire_;
  sim::ConnectionId connection_;
  const ServeOptions* options_;
  sim::Peer peer_;
  Bytes outgoing_ = {};
  Half input_ = Half::open;
  Half output_ = Half::open;
  enum class Health : std::uint8_t { sound, broken } health_ = Health::sound;
  std::optional<TimePoint> linger_until_ = std::nullopt;
};

}  // namespace spindle::posix
