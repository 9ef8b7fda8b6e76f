#pragma once

#include <optional>
#include <vector>

#include "spindle/commands/commands.hpp"
#include "spindle/sim/outage.hpp"

namespace spindle::commands {

/// The first option that does nothing for this profile.
std::optional<Error> useless_option(const SimulateOptions& options,
                                    const catalogue::Profile& profile);

/// The first fault or outage that a tool of this profile would not notice.
std::optional<Error> useless_trouble(const sim::FaultPlan& faults,
                                     const std::vector<sim::Outage>& outages,
                                     const catalogue::Profile& profile);

}  // namespace spindle::commands
