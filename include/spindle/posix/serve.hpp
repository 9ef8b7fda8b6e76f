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

/// Serves `server` on a pseudo terminal until an interrupt, or until a fault of the plan closes the
/// line, which is what pulling out the adapter looks like. `options.pty` is a symbolic link to the
/// terminal meanwhile; what exists there already is never touched. Errors: `port_busy` (the path is
/// taken), `port_unusable` (no terminal, or no link can be made; a rate that does not exist).
Result<void> serve_pty(sim::Server& server, const ServeOptions& options, const Clock& clock,
                       const Interrupt& interrupt);

/// serve_pty() or serve_tcp(), as the options say, with its clock and interrupt.
sim::Serve tool_server(Clock& clock, const Interrupt& interrupt);

}  // namespace spindle::posix
