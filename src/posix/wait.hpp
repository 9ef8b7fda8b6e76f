#pragma once

#include <poll.h>

#include <cstdint>
#include <ctime>
#include <span>

#include "posix/descriptor.hpp"
#include "spindle/base/clock.hpp"
#include "spindle/base/error.hpp"
#include "spindle/base/interrupt.hpp"

namespace spindle::posix {

/// Why a wait ended. An interrupt wins over everything else.
enum class Woken : std::uint8_t { ready, deadline, interrupted };

/// What is waited for; a negative descriptor never becomes ready.
struct Interest {
  int descriptor = -1;
  short events = 0;
};

/// Whether an interrupt ends a wait.
enum class Shield : std::uint8_t { down, up };

/// The kernel's form; what is negative has passed already and becomes zero.
timespec to_timespec(Duration duration);

/// One ppoll() until `deadline`: 0 at the deadline, negative when a signal came between. Fills in
/// `revents`.
int poll_until(std::span<pollfd> descriptors, TimePoint deadline, const Clock& clock);

/// Waits until the descriptor is ready, the deadline passes or an interrupt is raised.
Woken wait_for(Interest interest, TimePoint deadline, const Clock& clock,
               const Interrupt& interrupt, Shield shield = Shield::down);

/// The waits of one line, which interrupts end until it is shielded.
class LineWait {
 public:
  LineWait(const Clock& clock, const Interrupt& interrupt);

  void set_uninterruptible() { shield_ = Shield::up; }
  void set_interruptible() { shield_ = Shield::down; }
  /// Ends the wait for something to read, or the next one, as its deadline would. By any thread.
  void wake() const;

  /// Error: the interrupt that is raised.
  [[nodiscard]] Result<void> check() const;

  /// Whether the descriptor became ready before the deadline. Error: an interrupt.
  [[nodiscard]] Result<bool> until_ready(Interest interest, TimePoint deadline) const;

 private:
  const Clock* clock_;
  const Interrupt* interrupt_;
  Shield shield_ = Shield::down;
  Descriptor wake_;  ///< invalid where there is none left: then nothing wakes
};

}  // namespace spindle::posix
