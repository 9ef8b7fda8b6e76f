#pragma once

#include "spindle/commands/commands.hpp"
#include "spindle/work/connect.hpp"

namespace spindle::commands {

/// remote-start of a product whose motor is run by a command word: sets the operation data, runs
/// the motor until its time is over or somebody ends it, and always stops it.
Result<Outcome> run_motor(const RemoteStartOptions& options, const Target& target,
                          Context& context);

}  // namespace spindle::commands
