#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "event_records.hpp"
#include "spindle/catalogue/profile.hpp"
#include "spindle/commands/context.hpp"
#include "spindle/device/motor_follower.hpp"
#include "spindle/report/renderer.hpp"
#include "spindle/work/connect.hpp"

namespace spindle::commands {

/// As in records.
inline constexpr auto motor_event_words =
    enum_table<device::MotorEvent>({{"started", device::MotorEvent::started},
                                    {"at-speed", device::MotorEvent::at_speed},
                                    {"warning", device::MotorEvent::warning},
                                    {"alarm", device::MotorEvent::alarm},
                                    {"stopped", device::MotorEvent::stopped}});

/// "30h overload"; the code alone when it is not known, empty when it is 0.
std::string code_words(std::int64_t code, const catalogue::CodeTexts& texts);

/// The `event` record of something that was seen to happen to a motor.
report::Record motor_record(const device::MotorTransition& news, const Target& target,
                            const catalogue::CodeTables& tables);

/// What can be read of a motor, in words: whether it runs, its alarm, and the setting that its run
/// model depends on; empty where nothing says how it runs.
std::string motor_state_words(OpenTool& tool);

/// Columns of a stream of news of motors, drawn row by row.
std::vector<report::Column> motor_columns(Tools tools);

}  // namespace spindle::commands
