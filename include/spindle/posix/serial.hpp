#pragma once

#include <memory>
#include <string>

#include "spindle/base/clock.hpp"
#include "spindle/base/interrupt.hpp"
#include "spindle/link/endpoint.hpp"
#include "spindle/link/transport.hpp"

namespace spindle::posix {

/// Opens a serial line for this process alone and restores its settings at the end. The settings
/// are read back: what the port does not do is an error, never another rate in silence. send()
/// returns when the last byte has left. Errors: `port_missing`; `port_busy`, with the holder where
/// the system tells; `port_unusable` (no permission, no terminal, a setting that the port lacks).
/// Another program that has the port open without a lock is the transport's company().
/// When an adapter is pulled out, sending and receiving fail with `reset`.
Result<std::unique_ptr<link::Transport>> open_serial(const std::string& path,
                                                     const modbus::SerialSettings& settings,
                                                     link::LineSwitching switching,
                                                     const Clock& clock,
                                                     const Interrupt& interrupt);

/// What other programs call the line of this port, by whatever path it is named.
std::string serial_line_name(const std::string& path);

}  // namespace spindle::posix
