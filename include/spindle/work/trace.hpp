#pragma once

#include <string>

#include "spindle/work/environment.hpp"

namespace spindle::work {

/// What the environment shows of the line to this tool, and for --trace every frame as a packet in
/// the capture file.
link::Trace make_trace(const std::string& target, modbus::Framing framing,
                       const Environment& environment);

}  // namespace spindle::work
