#include "posix/wait.hpp"

#include <sys/eventfd.h>
#include <unistd.h>

#include <array>
#include <cstdint>

namespace spindle::posix {

timespec to_timespec(Duration duration) {
  if (duration < Duration::zero()) return {};
  const auto whole = std::chrono::duration_cast<std::chrono::seconds>(duration);
  return {.tv_sec = static_cast<time_t>(whole.count()),
          .tv_nsec = static_cast<long>((duration - whole).count())};
}

int poll_until(std::span<pollfd> descriptors, TimePoint deadline, const Clock& clock) {
  const TimePoint now = clock.now();
  // Compared first: the difference of far apart times does not fit.
  const timespec left = to_timespec(deadline > now ? deadline - now : Duration::zero());
  return ::ppoll(descriptors.data(), descriptors.size(), &left, nullptr);
}

Woken wait_for(Interest interest, TimePoint deadline, const Clock& clock,
               const Interrupt& interrupt, Shield shield) {
  const int wake = shield == Shield::down ? interrupt.descriptor() : -1;
  std::array<pollfd, 2> descriptors = {pollfd{interest.descriptor, interest.events, 0},
                                       pollfd{wake, POLLIN, 0}};
  for (;;) {
    if (shield == Shield::down && interrupt.raised()) return Woken::interrupted;
    const int ready = poll_until(descriptors, deadline, clock);
    if (ready == 0) return Woken::deadline;
    // A raised interrupt is told first, at the top.
    if (ready > 0 && descriptors[1].revents == 0) return Woken::ready;
    // After a signal, or when polling fails for want of memory, the deadline still ends the wait.
    if (ready < 0 && clock.now() >= deadline) return Woken::deadline;
  }
}

Result<void> LineWait::check() const {
  if (shield_ == Shield::up || !interrupt_->raised()) return {};
  return tl::unexpected(interrupt_->error());
}

LineWait::LineWait(const Clock& clock, const Interrupt& interrupt)
    : clock_(&clock), interrupt_(&interrupt), wake_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {}

void LineWait::wake() const {
  const std::uint64_t one = 1;
  // Fails only when the counter is full; then it is readable already.
  [[maybe_unused]] const ssize_t written = ::write(wake_.number(), &one, sizeof one);
}

Result<bool> LineWait::until_ready(Interest interest, TimePoint deadline) const {
  const int interrupted = shield_ == Shield::down ? interrupt_->descriptor() : -1;
  const int woken = interest.events == POLLIN ? wake_.number() : -1;
  std::array<pollfd, 3> descriptors = {pollfd{interest.descriptor, interest.events, 0},
                                       pollfd{interrupted, POLLIN, 0}, pollfd{woken, POLLIN, 0}};
  for (;;) {
    TRY(check());
    const int ready = poll_until(descriptors, deadline, *clock_);
    if (ready == 0) return false;
    if (ready < 0) {
      if (clock_->now() >= deadline) return false;
      continue;
    }
    if (descriptors[2].revents != 0) {
      std::uint64_t times = 0;
      [[maybe_unused]] const ssize_t taken = ::read(woken, &times, sizeof times);
    }
    // A raised interrupt is told first, at the top.
    if (descriptors[1].revents != 0) continue;
    return descriptors[0].revents != 0;
  }
}

}  // namespace spindle::posix
