#pragma once

#include <memory>

#include "run.hpp"

namespace spindle::commands {

/// remote-start by the run model command-register. Errors name the option that is missing or wrong.
Result<std::unique_ptr<RunPlan>> plan_command_register(const RemoteStartOptions& options,
                                                       const catalogue::Profile& profile,
                                                       const Target& target);

}  // namespace spindle::commands
