#pragma once

#include "spindle/base/clock.hpp"
#include "spindle/base/interrupt.hpp"
#include "spindle/sim/serve.hpp"

namespace spindle::posix {

using sim::ServeOptions;

/// Serves `server` to any number of clients in one thread until an interrupt; then closes
/// everything and returns success. Errors: `port_busy` (address in use), `port_unusable` (any other
/// reason, named).
Result<void> serve_tcp(sim::Server& server, const ServeOptions& options, Clock& clock,
                       const Interrupt& interrupt);

/// serve_tcp() with its clock and interrupt.
sim::Serve tool_server(Clock& clock, const Interrupt& interrupt);

}  // namespace spindle::posix
