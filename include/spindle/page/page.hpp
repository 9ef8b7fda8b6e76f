#pragma once

#include "spindle/commands/commands.hpp"

namespace spindle::page {

/// `spindle serve` without tools: a page of what is recorded, for reading only, until an interrupt.
Result<commands::Outcome> run(const commands::ServeOptions& options, commands::Context& context);

}  // namespace spindle::page
