#pragma once

#include <functional>
#include <map>
#include <utility>

#include "spindle/base/clock.hpp"
#include "spindle/base/interrupt.hpp"

namespace spindle::test {

/// A clock that moves only when the program sleeps on it or a test advances it. Wall time starts at
/// 2026-11-22T10:15:30.123Z and moves along.
class FakeClock final : public Clock {
 public:
  static constexpr TimePoint start = TimePoint(std::chrono::hours(1));
  static constexpr WallTime wall_start = WallTime(std::chrono::milliseconds(1'795'342'530'123));

  FakeClock() = default;
  /// Once `interrupt` is raised, every sleep fails at once with its error, as the real clock's do.
  explicit FakeClock(const Interrupt& interrupt) : interrupt_(&interrupt) {}

  [[nodiscard]] TimePoint now() const override { return now_; }

  [[nodiscard]] WallTime wall() const override {
    return wall_start + std::chrono::duration_cast<std::chrono::milliseconds>(now_ - start);
  }

  /// Moves time to `deadline`, never backwards, and runs the hooks on the way.
  Result<void> sleep_until(TimePoint deadline) override {
    while (!interrupted() && has_hook(deadline)) run_next_hook();
    if (interrupted()) return tl::unexpected(interrupt_->error());
    move_to(deadline);
    return {};
  }

  /// Moves time on without a sleep; hooks on the way run, interrupts do not matter.
  void advance(Duration by) {
    const TimePoint target = now_ + by;
    while (has_hook(target)) run_next_hook();
    move_to(target);
  }

  /// Runs `hook` once, when time reaches `when`: raise an interrupt, press a button.
  void at(TimePoint when, std::function<void()> hook) { hooks_.emplace(when, std::move(hook)); }

 private:
  [[nodiscard]] bool interrupted() const { return interrupt_ != nullptr && interrupt_->raised(); }
  [[nodiscard]] bool has_hook(TimePoint until) const {
    return !hooks_.empty() && hooks_.begin()->first <= until;
  }
  void run_next_hook() {
    auto hook = hooks_.extract(hooks_.begin());
    move_to(hook.key());
    hook.mapped()();
  }
  void move_to(TimePoint to) {
    if (to > now_) now_ = to;
  }

  const Interrupt* interrupt_ = nullptr;
  TimePoint now_ = start;
  std::multimap<TimePoint, std::function<void()>> hooks_ = {};
};

/// A clock whose sleeps no interrupt ends, beside the fake one.
class UninterruptibleClock final : public Clock {
 public:
  explicit UninterruptibleClock(FakeClock& clock) : clock_(&clock) {}
  [[nodiscard]] TimePoint now() const override { return clock_->now(); }
  [[nodiscard]] WallTime wall() const override { return clock_->wall(); }
  Result<void> sleep_until(TimePoint deadline) override {
    clock_->advance(deadline - clock_->now());
    return {};
  }

 private:
  FakeClock* clock_;
};

}  // namespace spindle::test
