#pragma once

#include <string>

#include "spindle/commands/context.hpp"

namespace spindle::commands {

/// For --verbose: every frame and decision as a line on stderr. For --trace: every frame as a
/// packet in the capture file. Otherwise nothing.
link::Trace make_trace(const std::string& target, modbus::Framing framing, const Context& context);

}  // namespace spindle::commands
