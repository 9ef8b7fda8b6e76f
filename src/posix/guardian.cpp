#include "spindle/posix/guardian.hpp"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <syslog.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <exception>
#include <system_error>

#include "spindle/posix/streams.hpp"

namespace spindle::posix {
namespace {

constexpr char all_is_safe = 's';
constexpr int no_descriptor = -1;

Error no_guardian(int failure) {
  return {.code = Errc::internal,
          .message =
              "a guardian, which stops the tool when this program dies, could not be "
              "started, so the tool was not started: " +
              std::generic_category().message(failure),
          .hint = "free memory or processes, then try again"};
}

// ---- in the guardian ----

/// What ends or stops a process that does not heed it, but for faults of its own.
void heed_no_signal() {
  const std::array own_faults = {SIGSEGV, SIGBUS,  SIGFPE, SIGILL,
                                 SIGABRT, SIGTRAP, SIGSYS, SIGCHLD};
  for (int number = 1; number <= SIGRTMAX; ++number) {
    const bool is_own = std::find(own_faults.begin(), own_faults.end(), number) != own_faults.end();
    ::signal(number, is_own ? SIG_DFL : SIG_IGN);
  }
}

/// A reader of a pipe waits until the last process that can write has ended: it is not kept
/// waiting.
bool may_keep_standard_error() {
  struct stat file = {};
  return ::isatty(STDERR_FILENO) == 1 ||
         (::fstat(STDERR_FILENO, &file) == 0 && S_ISREG(file.st_mode));
}

/// A descriptor that stays open here keeps the tool's only session, or the lock of a serial port.
void close_all_but(std::array<int, 2> kept) {
  std::sort(kept.begin(), kept.end());
  unsigned first = STDERR_FILENO + 1;
  for (const int one : kept) {
    if (one < static_cast<int>(first)) continue;
    if (one > static_cast<int>(first)) ::close_range(first, static_cast<unsigned>(one) - 1, 0);
    first = static_cast<unsigned>(one) + 1;
  }
  ::close_range(first, ~0U, 0);
  const int nothing = ::open("/dev/null", O_RDWR | O_CLOEXEC);
  if (nothing < 0) return;
  ::dup2(nothing, STDIN_FILENO);
  ::dup2(nothing, STDOUT_FILENO);
  if (!may_keep_standard_error()) ::dup2(nothing, STDERR_FILENO);
  ::close(nothing);
}

/// Empty: the other process ended.
bool hears_that_all_is_safe(int pipe) {
  char heard = 0;
  while (true) {
    const ssize_t got = ::read(pipe, &heard, 1);
    if (got < 0 && errno == EINTR) continue;
    return got == 1 && heard == all_is_safe;
  }
}

void tell(const std::string& words, int terminal) {
  ::openlog("spindle", LOG_PID, LOG_USER);
  ::syslog(LOG_CRIT, "%s", words.c_str());
  const std::string line = "spindle: " + words + "\n";
  write_err(line);
  if (terminal == no_descriptor) return;
  [[maybe_unused]] const ssize_t written = ::write(terminal, line.data(), line.size());
}

[[noreturn]] void guard(int pipe, const sigset_t& usual,
                        const std::function<std::string()>& when_orphaned) {
  // Before the session is left; a terminal behind standard error needs no second way to it.
  const bool is_seen = ::isatty(STDERR_FILENO) == 1;
  const int terminal =
      is_seen ? no_descriptor : ::open("/dev/tty", O_WRONLY | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  heed_no_signal();
  ::pthread_sigmask(SIG_SETMASK, &usual, nullptr);
  ::setsid();
  ::prctl(PR_SET_NAME, "guardian");  // who ends all programs of a name does not mean this one
  close_all_but({pipe, terminal});
  if (hears_that_all_is_safe(pipe)) ::_exit(0);
  try {
    tell(when_orphaned(), terminal);
  } catch (const std::exception& failed) {
    tell(std::string("THE TOOL MAY STILL RUN: its guardian failed: ") + failed.what(), terminal);
  }
  ::_exit(0);
}

// ---- in the process that is guarded ----

void tell_safe(int pipe, pid_t guardian) {
  while (::write(pipe, &all_is_safe, 1) < 0 && errno == EINTR) {
  }
  ::close(pipe);
  while (::waitpid(guardian, nullptr, 0) < 0 && errno == EINTR) {
  }
}

}  // namespace

Result<std::function<void()>> start_guardian(const std::function<std::string()>& when_orphaned) {
  std::array<int, 2> pipe = {};
  if (::pipe2(pipe.data(), O_CLOEXEC) != 0) return tl::unexpected(no_guardian(errno));
  // A signal to all processes of the terminal must not end the guardian before it heeds none.
  sigset_t all = {};
  sigset_t usual = {};
  ::sigfillset(&all);
  ::pthread_sigmask(SIG_SETMASK, &all, &usual);
  const pid_t guardian = ::fork();
  if (guardian == 0) {
    ::close(pipe[1]);
    guard(pipe[0], usual, when_orphaned);
  }
  const int failure = errno;
  ::pthread_sigmask(SIG_SETMASK, &usual, nullptr);
  ::close(pipe[0]);
  if (guardian < 0) {
    ::close(pipe[1]);
    return tl::unexpected(no_guardian(failure));
  }
  return [lifeline = pipe[1], guardian] { tell_safe(lifeline, guardian); };
}

}  // namespace spindle::posix
