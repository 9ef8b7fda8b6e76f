#pragma once

#include <cstdint>

#include "spindle/base/clock.hpp"

namespace spindle::sim {

enum class Turning : std::uint8_t { fastening, loosening };

/// One run-down as planned at its start: the speed ramps up, the screw turns freely, then
/// (fastening only) the torque rises to its target while the speed falls. Raw values of the preset.
struct RunPlan {
  Turning turning = Turning::fastening;
  std::uint16_t target_torque = 0;
  std::uint16_t final_torque = 0;  ///< reached at the end; near the target
  std::uint16_t speed = 0;         ///< rpm
  Duration ramp = {};
  Duration free_run = {};
  Duration rise = {};  ///< zero when loosening

  [[nodiscard]] Duration duration() const { return ramp + free_run + rise; }
};

/// How far a run is after some time. Angles in degrees.
struct Motion {
  std::uint16_t speed = 0;
  std::uint16_t torque = 0;
  std::uint16_t angle_before_snug = 0;
  std::uint16_t angle_after_snug = 0;
  std::uint16_t angle = 0;
};

Motion motion_at(const RunPlan& plan, Duration elapsed);

}  // namespace spindle::sim
