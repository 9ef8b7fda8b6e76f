#pragma once

#include <span>

#include "spindle/commands/target.hpp"
#include "spindle/device/run_guard.hpp"
#include "spindle/report/renderer.hpp"

namespace spindle::commands {

/// How often a stop is sent that stays without an answer or an effect.
inline constexpr int most_stops = 3;

/// Whether the tool may still run although it can be reached.
bool leaves_open(const Result<device::StopResult>& stopped);

/// Stops the motor of a product that is run by a command word, or all on the line where the target
/// says so. Whatever can be read helps to stop gently; whatever can not be read does not keep it
/// from being stopped.
Result<device::StopResult> stop_motor(OpenTool& tool, catalogue::StopMode mode,
                                      const Context& context);

/// The catalogue's action that starts a motion and can end it again. Error `usage` where a product
/// has none.
Result<catalogue::Action> find_start(const catalogue::Profile& profile);

/// The `action` record of a stop.
report::Record stop_record(device::StopResult result, const Target& target, const Clock& clock);
std::span<const report::Column> stop_columns();

/// The stop was acknowledged, and the tool says that it runs all the same.
Error still_runs(const Target& target);

}  // namespace spindle::commands
