#include "spindle/posix/signals.hpp"

#include <doctest/doctest.h>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdlib>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "spindle/posix/clock.hpp"

using namespace spindle;
using namespace std::chrono_literals;

namespace {

bool readable(int descriptor) {
  pollfd polled = {descriptor, POLLIN, 0};
  return ::poll(&polled, 1, 0) == 1;
}

// The wait status of a child that runs `body`, then ends with 0. For what ends a process.
int status_of_child(const std::function<void()>& body) {
  const pid_t child = ::fork();
  if (child == 0) {
    ::alarm(5);
    body();
    ::_exit(0);
  }
  int status = -1;
  ::waitpid(child, &status, 0);
  return status;
}

void (*handler_of(int number))(int) {
  struct sigaction action = {};
  ::sigaction(number, nullptr, &action);
  return action.sa_handler;
}

}  // namespace

TEST_CASE("signals: the first one raises the interrupt and makes its descriptor readable") {
  struct Row {
    int signal;
    Errc code;
    ExitStatus status;
  };
  const Row rows[] = {{SIGINT, Errc::interrupted, ExitStatus::interrupted},
                      {SIGTERM, Errc::terminated, ExitStatus::terminated},
                      {SIGHUP, Errc::terminated, ExitStatus::terminated},
                      {SIGQUIT, Errc::terminated, ExitStatus::terminated}};
  for (const Row& row : rows) {
    CAPTURE(row.signal);
    const posix::SignalWatch watch;
    REQUIRE_FALSE(watch.interrupt().raised());
    REQUIRE_FALSE(readable(watch.interrupt().descriptor()));
    ::raise(row.signal);
    REQUIRE(watch.interrupt().raised());
    CHECK(watch.interrupt().error().code == row.code);
    CHECK(watch.interrupt().error().status() == row.status);
    CHECK(readable(watch.interrupt().descriptor()));
    CHECK(readable(watch.interrupt().descriptor()));
  }
}

TEST_CASE("signals: every one that would end the process raises the interrupt instead") {
  std::vector<int> numbers = {SIGALRM, SIGXCPU, SIGVTALRM, SIGPROF, SIGIO, SIGPWR, SIGSTKFLT};
  for (int number = SIGRTMIN; number <= SIGRTMAX; ++number) numbers.push_back(number);
  for (const int number : numbers) {
    CAPTURE(number);
    const int status = status_of_child([number] {
      const posix::SignalWatch watch;
      ::raise(number);
      if (watch.interrupt().error().status() != ExitStatus::terminated) ::_exit(1);
      if (!readable(watch.interrupt().descriptor())) ::_exit(2);
    });
    CHECK(status == 0);
  }
}

TEST_CASE("signals: what only other programs understand changes nothing") {
  for (const int number : {SIGUSR1, SIGUSR2}) {
    CAPTURE(number);
    const int status = status_of_child([number] {
      const posix::SignalWatch watch;
      posix::SteadyClock clock(watch.interrupt());
      ::raise(number);
      if (watch.interrupt().raised()) ::_exit(1);
      if (!clock.sleep_until(clock.now() + 1ms)) ::_exit(2);
      ::raise(SIGTERM);
      if (!watch.interrupt().raised()) ::_exit(3);
    });
    CHECK(status == 0);
  }
}

TEST_CASE("signals: SIGHUP asks for a reload where that is heeded, and never for the end") {
  const int status = status_of_child([] {
    ::signal(SIGHUP, SIG_IGN);
    posix::SignalWatch watch;
    watch.heed_reload();
    if (watch.take_reload()) ::_exit(1);
    ::raise(SIGHUP);
    ::raise(SIGHUP);
    if (watch.interrupt().raised()) ::_exit(2);
    if (!watch.take_reload()) ::_exit(3);
    if (watch.take_reload()) ::_exit(4);
    ::raise(SIGTERM);
    ::raise(SIGHUP);
    if (watch.interrupt().error().status() != ExitStatus::terminated) ::_exit(5);
  });
  CHECK(status == 0);
}

TEST_CASE("signals: one that tells of a fault and comes from another process is a request") {
  for (const int number : {SIGABRT, SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGTRAP, SIGSYS}) {
    CAPTURE(number);
    const int status = status_of_child([number] {
      for (const int own : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT}) ::signal(own, SIG_DFL);
      const posix::SignalWatch watch;
      const pid_t self = ::getpid();
      const pid_t sender = ::fork();
      if (sender == 0) {
        ::kill(self, number);
        ::_exit(0);
      }
      ::waitpid(sender, nullptr, 0);
      if (!watch.interrupt().signalled()) ::_exit(1);
    });
    CHECK(status == 0);
  }
}

TEST_CASE("signals: a fault of the process itself ends it as always") {
  const int aborted = status_of_child([] {
    ::signal(SIGABRT, SIG_DFL);
    const posix::SignalWatch watch;
    std::abort();
  });
  REQUIRE(WIFSIGNALED(aborted));
  CHECK(WTERMSIG(aborted) == SIGABRT);
}

TEST_CASE("signals: the second one says what is left behind") {
  int ends[2];
  REQUIRE(::pipe(ends) == 0);
  const int status = status_of_child([&ends] {
    ::dup2(ends[1], STDERR_FILENO);
    posix::SignalWatch watch;
    watch.set_last_words("the tool may still run");
    ::raise(SIGINT);
    const Interrupt calm;
    posix::SteadyClock clock(calm);
    static_cast<void>(clock.sleep_until(clock.now() + 310ms));
    ::raise(SIGINT);
  });
  ::close(ends[1]);
  std::array<char, 128> told = {};
  const ssize_t length = ::read(ends[0], told.data(), told.size());
  ::close(ends[0]);
  REQUIRE(WIFEXITED(status));
  CHECK(WEXITSTATUS(status) == 130);
  REQUIRE(length > 0);
  CHECK(std::string(told.data(), static_cast<std::size_t>(length)) ==
        "spindle: the tool may still run\n");
}

TEST_CASE("signals: one that arrives during a sleep ends it") {
  const posix::SignalWatch watch;
  posix::SteadyClock clock(watch.interrupt());
  const pid_t self = ::getpid();
  const pid_t child = ::fork();
  if (child == 0) {
    ::kill(self, SIGTERM);
    ::_exit(0);
  }
  const Result<void> slept = clock.sleep_until(clock.now() + 5s);
  ::waitpid(child, nullptr, 0);
  REQUIRE_FALSE(slept.has_value());
  CHECK(slept.error().code == Errc::terminated);
}

TEST_CASE("signals: the second one ends the process with 128 + its number") {
  struct Row {
    int first;
    int second;
    int status;
  };
  const Row rows[] = {{SIGINT, SIGINT, 130}, {SIGTERM, SIGTERM, 143}, {SIGINT, SIGTERM, 143}};
  for (const Row& row : rows) {
    CAPTURE(row.first);
    CAPTURE(row.second);
    const int status = status_of_child([&row] {
      const posix::SignalWatch watch;
      ::raise(row.first);
      const Interrupt calm;
      posix::SteadyClock clock(calm);
      static_cast<void>(clock.sleep_until(clock.now() + 310ms));
      ::raise(row.second);
    });
    REQUIRE(WIFEXITED(status));
    CHECK(WEXITSTATUS(status) == row.status);
  }
}

TEST_CASE("signals: several at once are one wish") {
  const int status = status_of_child([] {
    const posix::SignalWatch watch;
    for (const int number : {SIGINT, SIGTERM, SIGHUP, SIGINT}) ::raise(number);
    if (watch.interrupt().error().code != Errc::interrupted) ::_exit(1);
  });
  CHECK(status == 0);
}

TEST_CASE("signals: Ctrl-Z suspends, until it is refused") {
  const int status = status_of_child([] {
    posix::SignalWatch watch;
    if (handler_of(SIGTSTP) != SIG_DFL) ::_exit(1);
    watch.refuse_suspend();
    ::raise(SIGTSTP);
    if (watch.interrupt().error().code != Errc::interrupted) ::_exit(2);
  });
  CHECK(status == 0);
  CHECK((handler_of(SIGTSTP) == SIG_DFL));
}

TEST_CASE("signals: what nohup ignores stays ignored") {
  const int status = status_of_child([] {
    ::signal(SIGHUP, SIG_IGN);
    const posix::SignalWatch watch;
    ::raise(SIGHUP);
    if (watch.interrupt().raised()) ::_exit(1);
  });
  CHECK(status == 0);
}

TEST_CASE("signals: writing to a closed pipe is an error, not the end") {
  const int status = status_of_child([] {
    const posix::SignalWatch watch;
    int ends[2];
    if (::pipe(ends) != 0) ::_exit(1);
    ::close(ends[0]);
    if (::write(ends[1], "x", 1) != -1 || errno != EPIPE) ::_exit(2);
  });
  CHECK(status == 0);
}

TEST_CASE("signals: afterwards the earlier handlers are back, and a new watch starts fresh") {
  constexpr int numbers[] = {SIGINT, SIGTERM, SIGPIPE};
  void (*before[3])(int) = {};
  for (int i = 0; i < 3; ++i) before[i] = handler_of(numbers[i]);
  {
    const posix::SignalWatch watch;
    for (int i = 0; i < 3; ++i) CHECK((handler_of(numbers[i]) != before[i]));
    ::raise(SIGINT);
    CHECK(watch.interrupt().raised());
  }
  for (int i = 0; i < 3; ++i) CHECK((handler_of(numbers[i]) == before[i]));
  const posix::SignalWatch again;
  CHECK_FALSE(again.interrupt().raised());
}
