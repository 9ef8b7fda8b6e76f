#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "spindle/commands/commands.hpp"
#include "spindle/device/motor.hpp"
#include "spindle/work/connect.hpp"

namespace spindle::commands {

/// Everything about the run of a motor that is decided before its driver is touched.
struct MotorPlan {
  device::Motor motor;
  std::uint16_t operation = 0;
  catalogue::Direction direction = catalogue::Direction::forward;
  /// Of the operation data, the speed first.
  std::vector<std::pair<catalogue::Parameter, catalogue::Value>> settings;
  std::optional<catalogue::Parameter> watchdog_parameter;
  std::optional<catalogue::Value> watchdog;

  [[nodiscard]] std::int64_t speed() const { return settings.front().second.number.mantissa(); }
};

/// Errors name the option that is missing or wrong.
Result<MotorPlan> plan_motor(const RemoteStartOptions& options, const catalogue::Profile& profile,
                             const Target& target);

Error bad_option(std::string_view option, std::string message, std::string hint = {});

}  // namespace spindle::commands
