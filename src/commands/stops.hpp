#pragma once

#include <span>
#include <string>

#include "spindle/commands/context.hpp"
#include "spindle/report/renderer.hpp"
#include "spindle/work/connect.hpp"
#include "spindle/work/stop.hpp"

namespace spindle::commands {

/// The `action` record of a stop.
report::Record stop_record(device::StopResult result, const Target& target, const Clock& clock);
std::span<const report::Column> stop_columns();

/// What helps where a stop could not be confirmed, with what else may keep this product running.
std::string where_to_stop(const catalogue::Profile* profile);

/// The stop was acknowledged, and the tool says that it runs all the same. `profile` may be null.
Error still_runs(const Target& target, const catalogue::Profile* profile);

}  // namespace spindle::commands
