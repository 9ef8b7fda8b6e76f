#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "spindle/base/clock.hpp"

namespace spindle::sim {

/// The speed of a simulated motor over time, in r/min, + forward. A ramp between standstill and a
/// speed takes the whole acceleration or deceleration time. Pure.
class Motor {
 public:
  /// Goes to a speed, through standstill when it turns the other way round.
  void go_to(std::int64_t speed, Duration acceleration, Duration deceleration, TimePoint now);
  /// Stands still at once.
  void brake(TimePoint now);
  /// Is let go, and comes to a stop by friction.
  void coast(TimePoint now);

  [[nodiscard]] std::int64_t speed(TimePoint now) const;
  [[nodiscard]] std::int64_t target() const { return target_; }
  /// It turns, or is told to.
  [[nodiscard]] bool moves(TimePoint now) const { return target_ != 0 || now < end(); }
  /// When the present ramps are over.
  [[nodiscard]] TimePoint end() const;

 private:
  struct Ramp {
    std::int64_t from;
    std::int64_t to;
    TimePoint begin;
    TimePoint end;
  };
  void add(std::int64_t from, std::int64_t to, Duration whole, TimePoint begin);

  std::vector<Ramp> ramps_ = {};
  std::int64_t target_ = 0;
};

}  // namespace spindle::sim
