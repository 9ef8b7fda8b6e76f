#include "spindle/device/motor_follower.hpp"

#include <algorithm>
#include <optional>
#include <utility>

namespace spindle::device {
namespace {

/// How long a driver may take to begin to run.
constexpr Duration start_grace = std::chrono::milliseconds(1000);
/// A motor runs: one lost answer is forgiven, however often the user lets reads be repeated.
constexpr unsigned retries_while_running = 1;
/// Answer timeouts that a look takes whose first answer is lost: that one, the silence behind it,
/// the proof of the line, and the repetition.
constexpr int timeouts_of_lost_look = 4;

/// Neither "it ran" nor "it did not" would be true.
Error not_seen() {
  return {.code = Errc::negative,
          .message =
              "the time allowed was over before the motor could be looked at, so whether it "
              "ran is not known",
          .hint = "allow more time with --for"};
}

class Follower {
 public:
  Follower(Device& device, const MotorMonitor& motor, Stopper& stopper,
           const MotorFollowOptions& options)
      : device_(&device),
        motor_(&motor),
        stopper_(&stopper),
        options_(&options),
        answer_timeout_(device.session().options().answer_timeout) {}

  Result<MotorEnding> follow() {
    const Clock& clock = device_->session().clock();
    const TimePoint began = clock.now();
    device_->set_retries(retries_while_running);
    std::optional<Error> last_silence;
    while (clock.now() < options_->deadline) {
      const bool nearly_over = limit_look();
      const auto state = motor_->look(*device_);
      const bool silent = !state && link::is_lost_answer(state.error());
      if (silent && nearly_over) {
        last_silence = state.error();
        continue;
      }
      if (!state) return tl::unexpected(state.error());
      seen_ = true;
      note(*state);
      if (const auto ending = judge(*state, clock.now() - began)) return *ending;
      if (options_->progress) {
        TRY(options_->progress(clock.now() - began, *state));
      }
      TRY(pause());
    }
    if (!seen_ && last_silence) return tl::unexpected(std::move(*last_silence));
    if (!seen_) return tl::unexpected(not_seen());
    return has_run_ ? MotorEnding::elapsed : MotorEnding::ignored;
  }

 private:
  /// Lets no look last much longer than the time allowed; true where it is too late to repeat one.
  bool limit_look() {
    const Duration left = options_->deadline - device_->session().clock().now();
    const Duration usual = device_->profile().link.answer;
    const Duration timeout =
        std::min(answer_timeout_, std::max(left / timeouts_of_lost_look, usual));
    device_->session().set_answer_timeout(timeout);
    const bool nearly_over = left < timeouts_of_lost_look * timeout;
    if (nearly_over) device_->set_retries(0);
    return nearly_over;
  }

  void note(const MotorState& state) {
    for (const MotorEvent event : events_between(before_, state)) {
      if (options_->on_transition)
        options_->on_transition({event, state, device_->session().clock().wall()});
    }
    before_ = state;
    if (!state.running) return;
    has_run_ = true;
    stopper_->seen_running();
  }

  [[nodiscard]] bool is_too_fast(const MotorState& state) const {
    if (!state.command_speed || !options_->fastest) return false;
    const Decimal& speed = *state.command_speed;
    const Decimal other_way(-speed.mantissa(), speed.exponent());
    return std::max(speed, other_way) > *options_->fastest;
  }

  [[nodiscard]] std::optional<MotorEnding> judge(const MotorState& state, Duration elapsed) const {
    if (state.alarm != 0) return MotorEnding::alarm;
    if (is_too_fast(state)) return MotorEnding::too_fast;
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
  const MotorMonitor* motor_;
  Stopper* stopper_;
  const MotorFollowOptions* options_;
  Duration answer_timeout_;  ///< the user's or the profile's
  MotorState before_ = {};
  bool seen_ = false;  ///< the driver has answered
  bool has_run_ = false;
};

}  // namespace

Result<MotorEnding> follow_motor(Device& device, const MotorMonitor& motor, Stopper& stopper,
                                 const MotorFollowOptions& options) {
  return Follower(device, motor, stopper, options).follow();
}

Result<MotorEnding> wait_unseen(Device& device, const MotorFollowOptions& options) {
  Clock& clock = device.session().clock();
  const TimePoint began = clock.now();
  while (clock.now() < options.deadline) {
    if (options.progress) {
      TRY(options.progress(clock.now() - began, {}));
    }
    const TimePoint next = std::min(options.deadline, clock.now() + options.interval);
    TRY(clock.sleep_until(next));
  }
  return MotorEnding::unseen;
}

}  // namespace spindle::device
