#include "bm_motion.hpp"

#include <algorithm>
#include <limits>

namespace spindle::sim {
namespace {

std::int64_t ms(Duration duration) {
  return std::chrono::duration_cast<std::chrono::milliseconds>(duration).count();
}

std::uint16_t to_register(std::int64_t value) {
  constexpr std::int64_t highest = std::numeric_limits<std::uint16_t>::max();
  return static_cast<std::uint16_t>(std::clamp<std::int64_t>(value, 0, highest));
}

// `part` of `whole` of a value; all of it when the whole takes no time.
std::int64_t share(std::int64_t value, std::int64_t part, std::int64_t whole) {
  return whole == 0 ? value : value * part / whole;
}

// Degrees turned in some milliseconds at a constant speed.
std::int64_t degrees(std::int64_t rpm, std::int64_t milliseconds) {
  constexpr std::int64_t degrees_per_turn = 360;
  constexpr std::int64_t milliseconds_per_minute = 60'000;
  return rpm * degrees_per_turn * milliseconds / milliseconds_per_minute;
}

}  // namespace

Motion motion_at(const RunPlan& plan, Duration elapsed) {
  const std::int64_t ramp = ms(plan.ramp);
  const std::int64_t free_run = ms(plan.free_run);
  const std::int64_t rise = ms(plan.rise);
  const std::int64_t now = std::clamp<std::int64_t>(ms(elapsed), 0, ramp + free_run + rise);

  // While the speed changes evenly, half the way of a constant speed is turned.
  const std::int64_t ramped = std::min(now, ramp);
  const std::int64_t freed = std::clamp<std::int64_t>(now - ramp, 0, free_run);
  const std::int64_t risen = std::clamp<std::int64_t>(now - ramp - free_run, 0, rise);
  const std::int64_t ramp_speed = share(plan.speed, ramped, ramp);
  const std::int64_t before = degrees(ramp_speed, ramped) / 2 + degrees(plan.speed, freed);
  const std::int64_t lost_speed = risen == 0 ? 0 : share(plan.speed, risen, rise);
  const std::int64_t after = degrees(plan.speed, risen) - degrees(lost_speed, risen) / 2;
  const bool at_end = plan.turning == Turning::fastening && now == ramp + free_run + rise;
  const std::int64_t torque =
      at_end ? plan.final_torque : (risen == 0 ? 0 : share(plan.final_torque, risen, rise));
  return {.speed = to_register(ramp_speed - lost_speed),
          .torque = to_register(torque),
          .angle_before_snug = to_register(before),
          .angle_after_snug = to_register(after),
          .angle = to_register(before + after)};
}

}  // namespace spindle::sim
