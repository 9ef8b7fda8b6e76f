#pragma once

#include <span>
#include <string>

#include "spindle/commands/target.hpp"
#include "spindle/device/motor.hpp"
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

/// Tells every motor on the line to stop, more than once, as none of them acknowledges it. Which
/// bit starts what on each of them can not be asked.
Result<void> broadcast_stop(device::Device& device, const device::Motor& motor,
                            catalogue::StopMode mode);

/// The catalogue's action that starts a motion and can end it again. Error `usage` where a product
/// has none.
Result<catalogue::Action> find_start(const catalogue::Profile& profile);

/// The `action` record of a stop.
report::Record stop_record(device::StopResult result, const Target& target, const Clock& clock);
std::span<const report::Column> stop_columns();

/// What helps where a stop could not be confirmed, with what else may keep this product running.
std::string where_to_stop(const catalogue::Profile* profile);

/// The stop was acknowledged, and the tool says that it runs all the same. `profile` may be null.
Error still_runs(const Target& target, const catalogue::Profile* profile);

}  // namespace spindle::commands
