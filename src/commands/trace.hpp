#pragma once

#include <string>

#include "spindle/commands/context.hpp"

namespace spindle::commands {

/// For --verbose: every frame and decision as a line on stderr; otherwise nothing.
link::Trace make_trace(const std::string& target, const Context& context);

}  // namespace spindle::commands
