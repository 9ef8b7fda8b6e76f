#include "spindle/posix/signals.hpp"

#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <ctime>
#include <utility>
#include <vector>

namespace spindle::posix {
namespace {

// A shell reads 128 + n as "ended by signal n".
constexpr int signal_status_base = 128;

// Those that wait for their request: the program ends, and leaves a tool safe.
constexpr std::array requests = {SIGINT,    SIGTERM, SIGHUP, SIGQUIT, SIGALRM,  SIGXCPU,
                                 SIGVTALRM, SIGPROF, SIGIO,  SIGPWR,  SIGSTKFLT};
// Raised by a fault of the process, after which nothing can be done in it, or sent by another one.
constexpr std::array faults = {SIGABRT, SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGTRAP, SIGSYS};
// A reader that has gone and a file that may not grow are told by the write itself. What only other
// programs understand must not end a run.
constexpr std::array disregarded = {SIGPIPE, SIGXFSZ, SIGUSR1, SIGUSR2};
// Left as they are until a tool runs.
constexpr std::array suspending = {SIGTSTP, SIGTTIN, SIGTTOU};

template <std::size_t count>
bool is_in(const std::array<int, count>& numbers, int number) {
  return std::find(numbers.begin(), numbers.end(), number) != numbers.end();
}

bool is_real_time(int number) { return number >= SIGRTMIN && number <= SIGRTMAX; }

bool is_watched(int number) {
  return is_in(requests, number) || is_in(faults, number) || is_in(disregarded, number) ||
         is_in(suspending, number) || is_real_time(number);
}

// Supervisors, wrappers and terminals send several signals for one wish. Those that follow this
// soon (a hand is slower) are part of the first, or they would end the process before it has
// stopped a motor.
constexpr std::int64_t signal_burst_ns = 50'000'000;

// The one mutable global of the program: a signal handler gets nothing but the signal's number, so
// the way to the Interrupt has to be static.
std::atomic<Interrupt*> watched{nullptr};
std::atomic<std::int64_t> first_signal_ns{0};   // its companion, for the same reason
std::array<char, 512> last_words = {};          // likewise
std::atomic<std::size_t> last_words_length{0};  // likewise
std::atomic<bool> reload_wanted{false};         // likewise
static_assert(std::atomic<Interrupt*>::is_always_lock_free, "read by a signal handler");
static_assert(std::atomic<std::size_t>::is_always_lock_free, "read by a signal handler");
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

[[noreturn]] void end_at_once(int number) {
  [[maybe_unused]] const ssize_t written =
      ::write(STDERR_FILENO, last_words.data(), last_words_length.load());
  ::_exit(signal_status_base + number);
}

extern "C" void on_signal(int number) {
  Interrupt* const interrupt = watched.load();
  if (interrupt == nullptr) return;
  const int interrupted_errno = errno;
  if (interrupt->signalled()) {
    if (monotonic_ns() - first_signal_ns.load() >= signal_burst_ns) end_at_once(number);
    errno = interrupted_errno;
    return;
  }
  first_signal_ns.store(monotonic_ns());
  interrupt->raise(number == SIGTSTP ? SIGINT : number);
  wake(*interrupt);
  errno = interrupted_errno;
}

extern "C" void on_hangup(int /*number*/) { reload_wanted.store(true); }

extern "C" void on_fault(int number, siginfo_t* info, void* /*context*/) {
  const bool is_sent = info->si_code == SI_USER || info->si_code == SI_QUEUE;
  if (is_sent && info->si_pid != ::getpid()) {
    on_signal(number);
    return;
  }
  // Behind the return the fault happens again, or abort() goes on, and the process ends.
  ::signal(number, SIG_DFL);
}

/// Those that no handler is interrupted by.
sigset_t held_back() {
  sigset_t held;
  ::sigemptyset(&held);
  for (int number = 1; number <= SIGRTMAX; ++number) {
    if (is_watched(number) && !is_in(faults, number)) ::sigaddset(&held, number);
  }
  return held;
}

struct sigaction action_for(int number, const sigset_t& held) {
  struct sigaction action = {};
  // No SA_RESTART: a question at the terminal must end too, and that is a plain read().
  const bool is_nothing = is_in(disregarded, number) || number == SIGTTIN || number == SIGTTOU;
  action.sa_handler = is_nothing ? SIG_IGN : on_signal;
  if (is_in(faults, number)) {
    action.sa_sigaction = on_fault;
    action.sa_flags = SA_SIGINFO;
    return action;
  }
  action.sa_mask = held;
  return action;
}

/// nohup and its like: what was ignored was meant to be. A shell ignores SIGINT and SIGQUIT for
/// what it starts in the background.
bool stays_ignored(int number, const struct sigaction& before) {
  const bool heeded = number == SIGINT || number == SIGQUIT || number == SIGTERM;
  return before.sa_handler == SIG_IGN && !heeded;
}

/// One that the process had taken for itself: a sanitizer, a debugger.
bool has_handler(const struct sigaction& action) {
  return action.sa_handler != SIG_DFL && action.sa_handler != SIG_IGN;
}

}  // namespace

struct SignalWatch::Previous {
  std::vector<std::pair<int, struct sigaction>> actions = {};
};

SignalWatch::SignalWatch()
    : interrupt_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)),
      previous_(std::make_unique<Previous>()) {
  watched.store(&interrupt_);
  const sigset_t held = held_back();
  previous_->actions.reserve(static_cast<std::size_t>(SIGRTMAX));
  for (int number = 1; number <= SIGRTMAX; ++number) {
    if (!is_watched(number)) continue;
    struct sigaction before = {};
    if (::sigaction(number, nullptr, &before) != 0) continue;
    previous_->actions.emplace_back(number, before);
    if (is_in(suspending, number)) continue;
    if (stays_ignored(number, before) || (is_in(faults, number) && has_handler(before))) continue;
    const struct sigaction action = action_for(number, held);
    ::sigaction(number, &action, nullptr);
  }
}

SignalWatch::~SignalWatch() {
  for (const auto& [number, action] : previous_->actions) ::sigaction(number, &action, nullptr);
  watched.store(nullptr);
  last_words_length.store(0);
  reload_wanted.store(false);
  ::close(interrupt_.descriptor());
}

void SignalWatch::refuse_suspend() {
  const sigset_t held = held_back();
  for (const int number : suspending) {
    const struct sigaction action = action_for(number, held);
    ::sigaction(number, &action, nullptr);
  }
}

void SignalWatch::heed_reload() {
  struct sigaction action = action_for(SIGHUP, held_back());
  action.sa_handler = on_hangup;
  ::sigaction(SIGHUP, &action, nullptr);
}

bool SignalWatch::take_reload() { return reload_wanted.exchange(false); }

void SignalWatch::set_last_words(std::string_view words) {
  last_words_length.store(0);
  if (words.empty()) return;
  // On a terminal the line of progress ends first.
  const std::string_view begin = ::isatty(STDERR_FILENO) == 1 ? "\nspindle: " : "spindle: ";
  std::size_t length = 0;
  for (const std::string_view part : {begin, words}) {
    const std::size_t room = last_words.size() - 1 - length;  // one for the end of the line
    length += part.copy(last_words.data() + length, room);
  }
  last_words[length++] = '\n';
  last_words_length.store(length);
}

void SignalWatch::end_waits() {
  interrupt_.end_waits();
  wake(interrupt_);
}

}  // namespace spindle::posix
