#include "spindle/posix/clock.hpp"

#include <cerrno>
#include <ctime>

#include "posix/wait.hpp"

namespace spindle::posix {
namespace {

// Without a descriptor nothing can wake a poll, so the kernel may as well keep the time: an
// absolute sleep does not drift when signals cut it into pieces.
Result<void> sleep_undescribed(TimePoint deadline, const Interrupt& interrupt) {
  const timespec until = to_timespec(deadline.time_since_epoch());
  int result = EINTR;
  while (result == EINTR) {
    if (interrupt.raised()) return tl::unexpected(interrupt.error());
    result = ::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr);
  }
  return {};
}

}  // namespace

TimePoint SteadyClock::now() const { return std::chrono::steady_clock::now(); }

WallTime SteadyClock::wall() const {
  return std::chrono::floor<std::chrono::milliseconds>(std::chrono::system_clock::now());
}

std::chrono::seconds SteadyClock::utc_offset(WallTime time) const {
  const std::time_t seconds =
      std::chrono::floor<std::chrono::seconds>(time.time_since_epoch()).count();
  std::tm shown = {};
  ::tzset();
  if (::localtime_r(&seconds, &shown) == nullptr) return {};
  return std::chrono::seconds(shown.tm_gmtoff);
}

Result<void> SteadyClock::sleep_until(TimePoint deadline) {
  if (interrupt_->descriptor() < 0) return sleep_undescribed(deadline, *interrupt_);
  if (wait_for({}, deadline, *this, *interrupt_) == Woken::interrupted) {
    return tl::unexpected(interrupt_->error());
  }
  return {};
}

}  // namespace spindle::posix
