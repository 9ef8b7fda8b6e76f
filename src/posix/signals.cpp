#include "spindle/posix/signals.hpp"

#include <sys/eventfd.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <ctime>

namespace spindle::posix {
namespace {

// A shell reads 128 + n as "ended by signal n".
constexpr int signal_status_base = 128;

constexpr std::array watched_signals = {SIGINT,  SIGTERM, SIGHUP, SIGQUIT,
                                        SIGPIPE, SIGXFSZ, SIGTSTP};

// Supervisors, wrappers and terminals send several signals for one wish. Those that follow this
// soon (a hand is slower) are part of the first, or they would end the process before it has
// stopped a motor.
constexpr std::int64_t one_wish_ns = 50'000'000;

// The one mutable global of the program: a signal handler gets nothing but the signal's number, so
// the way to the Interrupt has to be static.
std::atomic<Interrupt*> watched{nullptr};
std::atomic<std::int64_t> first_signal_ns{0};  // its companion, for the same reason
static_assert(std::atomic<Interrupt*>::is_always_lock_free, "read by a signal handler");
static_assert(std::atomic<std::int64_t>::is_always_lock_free, "read by a signal handler");

std::int64_t monotonic_ns() {
  timespec now = {};
  ::clock_gettime(CLOCK_MONOTONIC, &now);
  return std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

void wake(const Interrupt& interrupt) {
  const std::uint64_t one = 1;
  // Fails only when the counter is full; then it is readable already.
  [[maybe_unused]] const ssize_t written = ::write(interrupt.descriptor(), &one, sizeof one);
}

extern "C" void on_signal(int number) {
  Interrupt* const interrupt = watched.load();
  if (interrupt == nullptr) return;
  const int interrupted_errno = errno;
  if (interrupt->signalled()) {
    if (monotonic_ns() - first_signal_ns.load() >= one_wish_ns) {
      ::_exit(signal_status_base + number);
    }
    errno = interrupted_errno;
    return;
  }
  first_signal_ns.store(monotonic_ns());
  interrupt->raise(number == SIGTSTP ? SIGINT : number);
  wake(*interrupt);
  errno = interrupted_errno;
}

struct sigaction action_for(int number) {
  struct sigaction action = {};
  // No SA_RESTART: a question at the terminal must end too, and that is a plain read().
  // A reader that has gone and a file that may not grow are told by the write itself.
  const bool is_told = number == SIGPIPE || number == SIGXFSZ;
  action.sa_handler = is_told ? SIG_IGN : on_signal;
  for (const int other : watched_signals) ::sigaddset(&action.sa_mask, other);
  return action;
}

}  // namespace

struct SignalWatch::Previous {
  std::array<struct sigaction, watched_signals.size()> actions = {};
};

SignalWatch::SignalWatch()
    : interrupt_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)),
      previous_(std::make_unique<Previous>()) {
  watched.store(&interrupt_);
  for (std::size_t i = 0; i < watched_signals.size(); ++i) {
    const struct sigaction action = action_for(watched_signals[i]);
    struct sigaction& before = previous_->actions[i];
    if (watched_signals[i] == SIGTSTP) {  // until somebody refuses it
      ::sigaction(SIGTSTP, nullptr, &before);
      continue;
    }
    ::sigaction(watched_signals[i], &action, &before);
    // nohup: the terminal may go.
    if (watched_signals[i] == SIGHUP && before.sa_handler == SIG_IGN) {
      ::sigaction(SIGHUP, &before, nullptr);
    }
  }
}

SignalWatch::~SignalWatch() {
  for (std::size_t i = 0; i < watched_signals.size(); ++i) {
    ::sigaction(watched_signals[i], &previous_->actions[i], nullptr);
  }
  watched.store(nullptr);
  ::close(interrupt_.descriptor());
}

void SignalWatch::stay_awake() {
  const struct sigaction action = action_for(SIGTSTP);
  ::sigaction(SIGTSTP, &action, nullptr);
}

void SignalWatch::end_waits() {
  interrupt_.end_waits();
  wake(interrupt_);
}

}  // namespace spindle::posix
