#pragma once

#include <memory>

#include "spindle/base/interrupt.hpp"
#include "spindle/link/transport.hpp"
#include "spindle/modbus/adu.hpp"
#include "spindle/sim/fault_plan.hpp"
#include "spindle/sim/peer.hpp"
#include "spindle/sim/server.hpp"

namespace spindle::sim {

/// A transport whose other end is a simulated tool in the same process. Owns the tool. Time passes
/// only through `clock`; an answer takes 0.1 ms unless a fault says otherwise.
std::unique_ptr<link::Transport> make_sim_transport(std::unique_ptr<Server> server,
                                                    modbus::Framing framing, FaultPlan faults,
                                                    Clock& clock, const Interrupt& interrupt,
                                                    const LineModel& line = {});

/// The same on a tool that others hold too (several transports, one after another or side by side,
/// one tool, one thread). `server` and `counter` must outlive it.
std::unique_ptr<link::Transport> make_sim_transport(Server& server, ConnectionId connection,
                                                    modbus::Framing framing, FaultPlan faults,
                                                    AnswerCounter& counter, Clock& clock,
                                                    const Interrupt& interrupt,
                                                    const LineModel& line = {});

}  // namespace spindle::sim
