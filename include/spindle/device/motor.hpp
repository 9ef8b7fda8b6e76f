#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "spindle/device/device.hpp"
#include "spindle/device/run_guard.hpp"

namespace spindle::device {

/// What a driver says of its motor.
struct MotorState {
  bool running = false;   ///< it turns, or is told to
  bool at_speed = false;  ///< the speed asked for is reached
  bool busy = false;      ///< the driver works by itself
  std::int64_t command_speed = 0;
  std::int64_t feedback_speed = 0;  ///< signed, + forward
  std::int64_t load = 0;            ///< 0 where it can not be read
  std::int64_t alarm = 0;           ///< 0: none
  std::int64_t warning = 0;         ///< 0: none
};

/// What happened between two looks at a motor.
enum class MotorEvent : std::uint8_t { started, at_speed, warning, alarm, stopped };

/// In the order in which they can be told. An alarm or warning that goes is none. Pure.
std::vector<MotorEvent> events_between(const MotorState& before, const MotorState& now);

/// Reads and commands the motor of a product with `run`. Holds names and addresses only.
class Motor {
 public:
  /// Error `usage` where the product has no motor that a command word runs.
  static Result<Motor> of(const catalogue::Profile& profile);

  [[nodiscard]] const catalogue::RunFacts& facts() const { return facts_; }

  /// What look() reads, to be read along with other things.
  [[nodiscard]] const std::vector<catalogue::Parameter>& parameters() const { return parameters_; }
  /// Requires readings of parameters(), in that order.
  static Result<MotorState> state_of(std::span<const Reading> readings,
                                     const catalogue::RunFacts& facts);
  Result<MotorState> look(Device& device) const;

  /// Whether the motor stands still, and is told to: the least that proves a stop.
  Result<Shown> stands_still(Device& device) const;

  /// Whether the word is one that runs the motor in this mode.
  [[nodiscard]] bool runs(std::uint16_t word, std::int64_t mode) const;

  /// The command word, by FC 06: its answer repeats it, so it need not wait behind lost answers.
  Result<void> command(Device& device, std::uint16_t word) const;
  Result<void> broadcast(Device& device, std::uint16_t word) const;
  [[nodiscard]] modbus::RegisterAddress command_register() const { return command_register_; }

 private:
  catalogue::RunFacts facts_ = {};
  std::vector<catalogue::Parameter> parameters_ = {};
  modbus::RegisterAddress command_register_ = {};
};

/// Stops one motor, as gently as it was asked to, and harder when that does not help.
///
/// A word that decelerates in one input mode starts the motor in another, and a mode that was
/// written but not configured yet can not be told from one that counts. So the words of a mode are
/// used only for a motor that was seen to run by a word of that mode; else words that stop in every
/// mode.
class MotorStopper {
 public:
  MotorStopper(const Motor& motor, catalogue::StopMode mode) : motor_(&motor), mode_(mode) {}

  /// The word and the input mode by which the motor was started; not trusted until seen to run.
  void started(std::uint16_t word, std::int64_t mode, Duration stopping);
  void seen_running() { seen_running_ = true; }

  /// Reads how a motor runs that somebody else started. What can not be read is not needed.
  void observe(Device& device);

  /// Sends a stop and waits until the motor stands still; when it does not in the time that it
  /// needs, the next call brakes. May be repeated without harm.
  Result<StopResult> stop(Device& device, Clock& clock);

  /// How long the motor may need to stand still.
  [[nodiscard]] Duration stopping() const { return stopping_; }

 private:
  [[nodiscard]] std::uint16_t word() const;
  Result<StopResult> await_standstill(Device& device, Clock& clock, TimePoint deadline) const;

  const Motor* motor_;
  catalogue::StopMode mode_;
  std::uint16_t started_by_ = 0;
  std::optional<std::int64_t> input_mode_ = std::nullopt;
  bool seen_running_ = false;
  bool harder_ = false;  ///< the gentle stop did not help
  Duration stopping_ = {};
};

/// A time of operation data as a duration; `fallback` when it can not be read.
Duration time_of(const Reading& reading, Duration fallback);

/// The longest time that the profile allows for decelerating.
Duration longest_stop(const catalogue::Profile& profile);

}  // namespace spindle::device
