#pragma once

#include "spindle/commands/commands.hpp"

namespace spindle::forward {

/// `spindle forward`: hands what is in the store on to a sink, until an interrupt. At least once,
/// under keys that never change.
Result<commands::Outcome> run(const commands::ForwardOptions& options, commands::Context& context);

}  // namespace spindle::forward
