#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "spindle/base/clock.hpp"
#include "spindle/base/interrupt.hpp"
#include "spindle/modbus/adu.hpp"
#include "spindle/sim/fault_plan.hpp"
#include "spindle/sim/server.hpp"

namespace spindle::posix {

/// Where and how a simulated tool is served.
struct ServeOptions {
  std::string host = "127.0.0.1";
  std::uint16_t port = 0;  ///< 0: the system chooses
  modbus::Framing framing = modbus::Framing::tcp;
  sim::FaultPlan faults = {};
  /// Called once with the port that is listened on, before the first connection is accepted.
  std::function<Result<void>(std::uint16_t port)> listening = {};
  /// Hears every connection and all bytes as they come and go (usually a frame at a time):
  /// connection number, true direction as seen by the server.
  enum class Heard : std::uint8_t { connected, request, response, disconnected };
  std::function<void(Heard, std::uint32_t connection, ByteView bytes)> log = {};
};

/// Serves `server` to any number of clients in one thread until an interrupt; then closes
/// everything and returns success. Errors: `port_busy` (address in use), `port_unusable` (any other
/// reason, named).
Result<void> serve_tcp(sim::Server& server, const ServeOptions& options, Clock& clock,
                       const Interrupt& interrupt);

}  // namespace spindle::posix
