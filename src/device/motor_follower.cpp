#include "spindle/device/motor_follower.hpp"

#include <algorithm>
#include <cstdlib>

namespace spindle::device {
namespace {

/// How long a driver may take to begin to run.
constexpr Duration start_grace = std::chrono::milliseconds(1000);

class Follower {
 public:
  Follower(Device& device, const Motor& motor, MotorStopper& stopper,
           const MotorFollowOptions& options, std::vector<MotorNews>& news)
      : device_(&device), motor_(&motor), stopper_(&stopper), options_(&options), news_(&news) {}

  Result<MotorEnding> follow() {
    const Clock& clock = device_->session().clock();
    const TimePoint began = clock.now();
    while (clock.now() < options_->deadline) {
      const auto state = motor_->look(*device_);
      if (!state) return tl::unexpected(state.error());
      note(*state);
      if (const auto ending = judge(*state, clock.now() - began)) return *ending;
      if (options_->progress) {
        if (auto told = options_->progress(clock.now() - began, *state); !told) {
          return tl::unexpected(std::move(told.error()));
        }
      }
      if (auto paused = pause(); !paused) return tl::unexpected(std::move(paused.error()));
    }
    return has_run_ ? MotorEnding::elapsed : MotorEnding::ignored;
  }

 private:
  void note(const MotorState& state) {
    for (const MotorEvent event : events_between(before_, state)) {
      news_->push_back({event, state, device_->session().clock().wall()});
    }
    before_ = state;
    if (!state.running) return;
    has_run_ = true;
    stopper_->seen_running();
  }

  [[nodiscard]] std::optional<MotorEnding> judge(const MotorState& state, Duration elapsed) const {
    if (state.alarm != 0) return MotorEnding::alarm;
    if (std::abs(state.command_speed) > options_->fastest) return MotorEnding::too_fast;
    if (state.running) return std::nullopt;
    if (has_run_) return MotorEnding::stopped;
    if (elapsed > start_grace) return MotorEnding::ignored;
    return std::nullopt;
  }

  Result<void> pause() {
    Clock& clock = device_->session().clock();
    return clock.sleep_until(std::min(options_->deadline, clock.now() + options_->interval));
  }

  Device* device_;
  const Motor* motor_;
  MotorStopper* stopper_;
  const MotorFollowOptions* options_;
  std::vector<MotorNews>* news_;
  MotorState before_ = {};
  bool has_run_ = false;
};

}  // namespace

Result<MotorEnding> follow_motor(Device& device, const Motor& motor, MotorStopper& stopper,
                                 const MotorFollowOptions& options, std::vector<MotorNews>& news) {
  return Follower(device, motor, stopper, options, news).follow();
}

}  // namespace spindle::device
