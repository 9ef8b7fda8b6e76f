#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "spindle/device/device.hpp"

namespace spindle::device {

/// What a driver says of its motor, in the units of its profile.
struct MotorState {
  bool running = false;                                  ///< it turns, or is told to
  bool at_speed = false;                                 ///< the speed asked for is reached
  bool busy = false;                                     ///< the driver works by itself
  std::optional<Decimal> command_speed = std::nullopt;   ///< empty: not known
  std::optional<Decimal> feedback_speed = std::nullopt;  ///< signed, + forward; empty: not known
  std::optional<Decimal> load = std::nullopt;            ///< empty: not known
  std::int64_t alarm = 0;                                ///< 0: none
  std::int64_t warning = 0;                              ///< 0: none
};

/// What happened between two looks at a motor.
enum class MotorEvent : std::uint8_t { started, at_speed, warning, alarm, stopped };

/// In the order in which they can be told. An alarm or warning that goes is none. Pure.
std::vector<MotorEvent> events_between(const MotorState& before, const MotorState& now);

/// Reads how a motor runs. Holds parameters only.
class MotorMonitor {
 public:
  /// Error `unknown_name` where the profile lacks one of the names. Requires facts with a status
  /// or a speed.
  static Result<MotorMonitor> of(const catalogue::MonitorSpec& facts,
                                 const catalogue::Profile& profile);

  /// What look() reads, to be read along with other things.
  [[nodiscard]] const std::vector<catalogue::Parameter>& parameters() const { return parameters_; }
  /// Whether this parameter says that something happened: that it runs, an alarm, a warning.
  [[nodiscard]] bool tells(std::string_view parameter) const;
  /// Whether it says that the motor runs.
  [[nodiscard]] bool tells_running(std::string_view parameter) const;
  /// Whether this status says that the driver works by itself.
  [[nodiscard]] bool is_busy(const Decimal& status) const;
  [[nodiscard]] const catalogue::MonitorSpec& facts() const { return facts_; }

  /// Lays what one parameter says over a state. Error: the reading has none.
  Result<void> note(const Reading& reading, MotorState& state) const;
  Result<MotorState> look(Device& device) const;

  /// Whether the motor stands still, and is told to: the least that proves a stop.
  Result<Shown> stands_still(Device& device) const;

  /// The unit of its speed, as in the profile; may be empty.
  [[nodiscard]] const std::string& speed_unit() const { return speed_unit_; }

 private:
  [[nodiscard]] bool runs(std::int64_t status) const;
  [[nodiscard]] bool is_still(const Reading& reading) const;

  catalogue::MonitorSpec facts_ = {};
  std::string speed_unit_ = {};
  std::vector<catalogue::Parameter> parameters_ = {};
  std::vector<catalogue::Parameter> proof_ = {};  ///< of a standstill
};

/// A time as a duration, in seconds with up to three decimals; `fallback` when it cannot be read.
Duration time_of(const Reading& reading, Duration fallback);

}  // namespace spindle::device
