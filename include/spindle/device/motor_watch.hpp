#pragma once

#include <cstddef>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "spindle/device/motor_follower.hpp"

namespace spindle::device {

/// Finds out what a motor does with few requests: the values that say that something happened
/// (status, alarm, warning) are read by turns, one piece at a time, between other reads; speed and
/// load only when something did happen.
class MotorWatch {
 public:
  /// `polled` are values that are read anyhow: what is among them needs no turn.
  MotorWatch(MotorMonitor motor, const std::vector<catalogue::Parameter>& polled);

  /// Reads the next piece, or nothing where all of it is among the polled values. Gives back what
  /// happened since it was read last, also on an earlier connection; at first there is nothing to
  /// compare.
  Result<std::vector<MotorTransition>> take_turn(Device& device);

  /// The same for what was read along with other values.
  Result<std::vector<MotorTransition>> take(Device& device, std::span<const Reading> readings);

  /// Whether take_turn() has anything to read.
  [[nodiscard]] bool needs_turns() const { return !pieces_.empty(); }

 private:
  [[nodiscard]] const std::vector<catalogue::Parameter>& next_piece();
  Result<MotorState> look(Device& device) const;
  [[nodiscard]] bool knows_running() const;
  [[nodiscard]] Result<MotorState> with(std::span<const Reading> readings);

  MotorMonitor motor_;
  MotorState state_ = {};            ///< as seen last
  std::set<std::string> seen_ = {};  ///< parameters that were read at least once
  /// What one request can read each; the first one holds the alarm, where that needs a turn.
  std::vector<std::vector<catalogue::Parameter>> pieces_ = {};
  std::size_t turn_ = 0;
};

}  // namespace spindle::device
