#pragma once

#include <span>

#include "spindle/commands/target.hpp"
#include "spindle/device/run_guard.hpp"
#include "spindle/report/renderer.hpp"

namespace spindle::commands {

/// The catalogue's action that starts a motion and can end it again. Error `usage` where a product
/// has none.
Result<catalogue::Action> find_start(const catalogue::Profile& profile);

/// The `action` record of a stop.
report::Record stop_record(device::StopResult result, const Target& target, const Clock& clock);
std::span<const report::Column> stop_columns();

/// The stop was acknowledged, and the tool says that it runs all the same.
Error still_runs(const Target& target);

}  // namespace spindle::commands
