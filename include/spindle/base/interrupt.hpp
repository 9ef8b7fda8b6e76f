#pragma once

#include <atomic>

#include "spindle/base/error.hpp"

namespace spindle {

/// Whether a signal asked the program to end. Set once by the signal handler, seen by every wait.
/// Setting it is async-signal-safe. `posix` makes the descriptor readable when it is set, so that
/// all threads that poll it wake at once.
class Interrupt {
 public:
  /// `wake_descriptor` is included in every poll; -1 where nothing polls (tests).
  explicit Interrupt(int wake_descriptor = -1) : wake_descriptor_(wake_descriptor) {}

  /// Remembers the first signal (SIGINT = 2, SIGTERM = 15, as numbered by POSIX systems).
  void raise(int signal_number) noexcept;

  /// The program itself wants every wait to end, without any signal.
  void end_waits() noexcept { ended_.store(true); }

  /// Whether waits have to end, for either reason.
  [[nodiscard]] bool raised() const noexcept { return signalled() || ended_.load(); }
  [[nodiscard]] bool signalled() const noexcept { return signal_.load() != 0; }
  [[nodiscard]] int descriptor() const noexcept { return wake_descriptor_; }

  /// `Errc::interrupted` for SIGINT and without a signal, `Errc::terminated` for other signals.
  [[nodiscard]] Error error() const;

 private:
  std::atomic<int> signal_{0};
  std::atomic<bool> ended_{false};
  int wake_descriptor_;
};

}  // namespace spindle
