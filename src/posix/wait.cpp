#include "posix/wait.hpp"

#include <array>

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

Result<bool> LineWait::until_ready(Interest interest, TimePoint deadline) const {
  const Woken woken = wait_for(interest, deadline, *clock_, *interrupt_, shield_);
  if (woken == Woken::interrupted) return tl::unexpected(interrupt_->error());
  return woken == Woken::ready;
}

}  // namespace spindle::posix
