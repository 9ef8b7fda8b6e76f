#pragma once

#include <string>

#include "spindle/commands/commands.hpp"
#include "spindle/work/owned_lines.hpp"

namespace spindle::commands {

/// Lets other spindles ask on the lines, and where the user says so any program. Tells where.
/// Errors: `usage` for an address that is none, and those of OwnedLines::listen().
Result<void> let_others_ask(OwnedLines& lines, const GatewayOptions& options,
                            const OwnedLines::Note& note);

/// `spindle serve TARGET...`: holds the tools for others until a signal. Nothing is asked of them
/// but what keeps their links.
Result<Outcome> hold_tools(const ServeOptions& options, Context& context);

}  // namespace spindle::commands
