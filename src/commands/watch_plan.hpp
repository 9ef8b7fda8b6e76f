#pragma once

#include "spindle/commands/commands.hpp"
#include "spindle/device/watcher.hpp"
#include "watched_tool.hpp"

namespace spindle::commands {

/// What to watch on a tool of this profile. Error `usage` where there is nothing, and where an
/// option does nothing. The usual pace is that of the profile, or ours.
Result<device::WatchPlan> plan_watch(const WatchOptions& options,
                                     const catalogue::Profile& profile);

/// Refuses what can be known to be wrong before a tool is asked: of one whose profile is not known,
/// what no profile would take.
Result<void> check_watch(const WatchOptions& options, const WatchedTool& tool, ProfileShelf& shelf,
                         const Context& context);

}  // namespace spindle::commands
