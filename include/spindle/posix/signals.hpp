#pragma once

#include <memory>

#include "spindle/base/interrupt.hpp"

namespace spindle::posix {

/// Owns the process's Interrupt while it lives: SIGINT, SIGTERM, SIGQUIT and SIGHUP (unless nohup
/// ignores it) raise it and make its eventfd readable (it stays readable). A second signal ends the
/// process at once with 128 + its number, unless it comes within 0.05 s: that is one wish said
/// twice, and a motor is being stopped. SIGPIPE is ignored. The handlers before it come back at its
/// end. At most one may exist.
class SignalWatch {
 public:
  SignalWatch();
  ~SignalWatch();
  SignalWatch(const SignalWatch&) = delete;
  SignalWatch& operator=(const SignalWatch&) = delete;
  [[nodiscard]] const Interrupt& interrupt() const { return interrupt_; }

  /// Ends every wait, as a signal would. May be called from any thread.
  void end_waits();

  /// From now on SIGTSTP (Ctrl-Z) raises the interrupt as SIGINT does, instead of suspending.
  void stay_awake();

 private:
  struct Previous;

  Interrupt interrupt_;
  std::unique_ptr<Previous> previous_;
};

}  // namespace spindle::posix
