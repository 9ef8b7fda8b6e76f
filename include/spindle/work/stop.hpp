#pragma once

#include <string>

#include "spindle/device/run_model.hpp"
#include "spindle/work/connect.hpp"

namespace spindle::work {

/// How often a stop is sent that stays without an answer or an effect.
inline constexpr int most_stops = 3;

/// Whether the tool may still run although it can be reached.
bool leaves_open(const Result<device::StopResult>& stopped);

/// Stops the motor of a product that is run by a command word, or all on the line where the target
/// says so. Whatever can be read helps to stop gently; whatever cannot be read does not keep it
/// from being stopped.
Result<device::StopResult> stop_motor(OpenTool& tool, catalogue::StopMode mode,
                                      const Environment& environment);

/// Tells every motor on the line to stop, more than once, as none of them acknowledges it.
Result<void> broadcast_stop(device::Device& device, const device::RunModel& model,
                            catalogue::StopMode mode);

/// What helps where a stop could not be confirmed, with what else may keep this product running.
std::string where_to_stop(const catalogue::Profile* profile);

/// The stop was acknowledged, and the tool says that it runs all the same. `profile` may be null.
Error still_runs(const Target& target, const catalogue::Profile* profile);

}  // namespace spindle::work
