#pragma once

#include <functional>
#include <memory>

#include "run.hpp"
#include "spindle/work/motor_setup.hpp"

namespace spindle::commands {

using MakeMotorSetup = std::function<std::unique_ptr<MotorSetup>(work::ChangeLog&)>;

/// The run of a motor that is told by polling it, or by nothing where `monitor` is null: until its
/// time is over, or a signal ends it. All but `make_setup` must outlive it.
std::unique_ptr<ToolRun> make_motor_run(const MotorPlan& plan, const device::MotorMonitor* monitor,
                                        OpenTool& tool, Context& context,
                                        const MakeMotorSetup& make_setup);

/// "run the motor of conveyor1 at 500 r/min forward for 2s: the motor will turn".
std::string run_in_words(const MotorPlan& plan, const Target& target);

/// Error `usage`: no speed was given, such as 500 r/min.
Error speed_is_missing(std::string_view example = "500");
/// Error `usage` where the motor would not turn.
Result<void> check_turns(const MotorPlan& plan);

}  // namespace spindle::commands
