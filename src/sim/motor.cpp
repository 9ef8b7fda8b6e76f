#include "motor.hpp"

#include <algorithm>
#include <cstdlib>

namespace spindle::sim {
namespace {

// How long a motor that is let go turns on; the real time depends on the load.
constexpr Duration coasting = std::chrono::milliseconds(800);

// `part` of `whole` of a value. Hours times thousands of turns do not fit 64 bits in nanoseconds.
std::int64_t share(std::int64_t value, std::int64_t part, std::int64_t whole) {
  return static_cast<std::int64_t>(static_cast<long double>(value) *
                                   static_cast<long double>(part) /
                                   static_cast<long double>(whole));
}

}  // namespace

void Motor::add(std::int64_t from, std::int64_t to, Duration whole, TimePoint begin) {
  const std::int64_t larger = std::max(std::abs(from), std::abs(to));
  const std::int64_t step = std::abs(to - from);
  const Duration time =
      larger == 0 ? Duration::zero() : Duration(share(whole.count(), step, larger));
  ramps_.push_back({from, to, begin, begin + time});
}

void Motor::go_to(std::int64_t speed, Duration acceleration, Duration deceleration, TimePoint now) {
  if (speed == target_ && !ramps_.empty() && speed != 0) return;  // it is on its way there
  const std::int64_t from = this->speed(now);
  ramps_.clear();
  target_ = speed;
  const bool turns_round = (from < 0 && speed > 0) || (from > 0 && speed < 0);
  if (turns_round) {
    add(from, 0, deceleration, now);
    add(0, speed, acceleration, ramps_.back().end);
  } else {
    const bool faster = std::abs(speed) > std::abs(from);
    add(from, speed, faster ? acceleration : deceleration, now);
  }
}

void Motor::brake(TimePoint now) {
  ramps_ = {{0, 0, now, now}};
  target_ = 0;
}

void Motor::coast(TimePoint now) {
  const std::int64_t from = speed(now);
  ramps_.clear();
  target_ = 0;
  add(from, 0, coasting, now);
}

std::int64_t Motor::speed(TimePoint now) const {
  for (const Ramp& ramp : ramps_) {
    if (now >= ramp.end) continue;
    const auto passed = std::max(now - ramp.begin, Duration::zero()).count();
    const auto whole = (ramp.end - ramp.begin).count();
    return ramp.from + share(ramp.to - ramp.from, passed, whole);
  }
  return target_;
}

TimePoint Motor::end() const { return ramps_.empty() ? TimePoint::min() : ramps_.back().end; }

}  // namespace spindle::sim
