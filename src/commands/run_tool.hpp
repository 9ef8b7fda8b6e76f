#pragma once

#include "spindle/commands/commands.hpp"
#include "spindle/work/connect.hpp"

namespace spindle::commands {

/// remote-start of a tool with events: selects what was asked for, starts the tool, follows it
/// until its result, always stops it, and leaves it as it was found.
Result<Outcome> run_tool(const RemoteStartOptions& options, const Target& target, Context& context);

}  // namespace spindle::commands
