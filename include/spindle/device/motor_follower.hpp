#pragma once

#include <functional>

#include "spindle/device/run_model.hpp"

namespace spindle::device {

/// Why following a running motor is over.
enum class MotorEnding : std::uint8_t {
  elapsed,   ///< the time allowed is over; it still runs
  alarm,     ///< an alarm ended the run
  stopped,   ///< it stopped, and not by this program
  ignored,   ///< the start was acknowledged, but the motor does not run
  too_fast,  ///< its command speed is above the one asked for
  unseen,    ///< the time allowed is over, and nothing that can be read says whether it ran
};

/// Something that happened to a motor, as seen by polling.
struct MotorTransition {
  MotorEvent event;
  MotorState state;
  WallTime time;
};

struct MotorFollowOptions {
  TimePoint deadline = TimePoint::max();
  Duration interval = std::chrono::milliseconds(100);  ///< between two looks
  std::optional<Decimal> fastest = std::nullopt;       ///< command speed that is asked for
  /// Hears how long it has run and how, several times a second; an error ends the following.
  std::function<Result<void>(Duration elapsed, const MotorState&)> progress = {};
  /// Hears what happens when it is seen; must not use the device.
  std::function<void(const MotorTransition&)> on_transition = {};
};

/// Follows a motor from just behind its start. Starts and stops nothing. Errors: interrupts and
/// link trouble. A driver that falls silent is hardly waited for beyond the deadline, however
/// patient the user is with answers; the answer timeout and the retries of the device are then
/// those of a running motor.
Result<MotorEnding> follow_motor(Device& device, const MotorMonitor& motor, Stopper& stopper,
                                 const MotorFollowOptions& options);

/// The same for a motor of which nothing can be read: lets the time pass. Errors: interrupts.
Result<MotorEnding> wait_unseen(Device& device, const MotorFollowOptions& options);

}  // namespace spindle::device
