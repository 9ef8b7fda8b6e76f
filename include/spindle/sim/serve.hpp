#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "spindle/base/bytes.hpp"
#include "spindle/base/error.hpp"
#include "spindle/modbus/adu.hpp"
#include "spindle/sim/fault_plan.hpp"
#include "spindle/sim/outage.hpp"
#include "spindle/sim/serial_line.hpp"
#include "spindle/sim/server.hpp"

namespace spindle::sim {

/// What happens on a connection of a served tool; directions as the server sees them.
enum class Heard : std::uint8_t { connected, request, response, disconnected };

/// Where and how a simulated tool is served.
struct ServeOptions {
  std::string host = "127.0.0.1";
  std::uint16_t port = 0;  ///< 0: the system chooses
  modbus::Framing framing = modbus::Framing::tcp;
  /// Instead of host and port: a serial line. A pseudo terminal is made, and this path leads to it
  /// as long as the tool is served.
  std::string pty = {};
  unsigned baud = 0;  ///< of that line; what comes at another rate is heard as noise; 0: any rate
  LineModel line = {};
  FaultPlan faults = {};
  std::vector<Outage> outages = {};  ///< counted from the beginning of serving
  /// Called once with the port that is listened on (0 on a serial line), before any client is
  /// served.
  std::function<Result<void>(std::uint16_t port)> listening = {};
  /// Hears every connection and all bytes as they come and go (usually a frame at a time).
  std::function<void(Heard, std::uint32_t connection, ByteView bytes)> log = {};
  /// Hears of what came and is not answered, and why.
  std::function<void(std::uint32_t connection, ByteView bytes, std::string_view reason)> ignored =
      {};
};

/// Serves a tool to any number of clients until an interrupt; `posix` brings the implementation.
using Serve = std::function<Result<void>(Server& server, const ServeOptions& options)>;

}  // namespace spindle::sim
