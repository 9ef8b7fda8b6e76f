#pragma once

#include <string>

#include "spindle/commands/commands.hpp"
#include "spindle/link/endpoint.hpp"

namespace spindle::commands {

/// Where the tool is served; of a pseudo terminal the path is absolute, as clients name it. Port 0
/// is a free one. Errors `usage` and `bad_target` for a place that tools of this profile have not.
Result<link::Endpoint> place_of(const SimulateOptions& options, const catalogue::Profile& profile);

/// What a client gives as its target, complete with what it needs to get an answer.
std::string url_of(const link::Endpoint& place, const SimulateOptions& options);

}  // namespace spindle::commands
