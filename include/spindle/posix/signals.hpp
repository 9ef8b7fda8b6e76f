#pragma once

#include <memory>
#include <string_view>

#include "spindle/base/interrupt.hpp"

namespace spindle::posix {

/// Owns the process's Interrupt while it lives: every signal that would end the process, and that a
/// process can catch, raises it and makes its eventfd readable (it stays readable). What was
/// ignored before stays ignored, but for SIGINT, SIGTERM and SIGQUIT. A second signal ends the
/// process at once with 128 + its number, unless it comes within 0.05 s: that is one wish said
/// twice, and a motor is being stopped. SIGPIPE and SIGXFSZ are ignored, and SIGUSR1 and SIGUSR2,
/// which mean nothing here and may be meant for another program. A fault of the process
/// itself (SIGSEGV, SIGABRT and their like, unless another process sent it) ends it as always. The
/// handlers before it come back at its end. At most one may exist.
class SignalWatch {
 public:
  SignalWatch();
  ~SignalWatch();
  SignalWatch(const SignalWatch&) = delete;
  SignalWatch& operator=(const SignalWatch&) = delete;
  [[nodiscard]] const Interrupt& interrupt() const { return interrupt_; }

  /// Ends every wait, as a signal would. May be called from any thread.
  void end_waits();

  /// From now on SIGTSTP (Ctrl-Z) raises the interrupt as SIGINT does, instead of suspending, and
  /// the use of a terminal that is another program's now (SIGTTIN, SIGTTOU) suspends neither.
  void refuse_suspend();

  /// From now on SIGHUP does not end the process: it asks for what take_reload() tells.
  void heed_reload();

  /// Whether SIGHUP came since this was last asked.
  bool take_reload();

  /// What is told on standard error when a second signal ends the process; empty: nothing. Words
  /// that are too long are cut.
  void set_last_words(std::string_view words);

 private:
  struct Previous;

  Interrupt interrupt_;
  std::unique_ptr<Previous> previous_;
};

}  // namespace spindle::posix
