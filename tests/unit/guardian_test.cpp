#include "spindle/posix/guardian.hpp"

#include <doctest/doctest.h>
#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <functional>
#include <stdexcept>
#include <string>

using namespace spindle;

namespace {

/// What the guardian of a process says that does `body`; the test's own process has none.
std::string told_by_guardian(
    const std::function<void(const std::function<void()>& tell_safe)>& body,
    const std::function<std::string()>& when_orphaned) {
  ::prctl(PR_SET_CHILD_SUBREAPER, 1);  // who outlives its parent is waited for here
  std::FILE* const file = std::tmpfile();
  REQUIRE(file != nullptr);
  const pid_t guarded = ::fork();
  if (guarded == 0) {
    ::alarm(20);
    ::dup2(::fileno(file), STDERR_FILENO);
    const auto tell_safe = posix::start_guardian(when_orphaned);
    if (!tell_safe) ::_exit(1);
    body(*tell_safe);
    ::_exit(0);
  }
  while (::waitpid(-1, nullptr, 0) > 0 || errno == EINTR) {
  }
  std::array<char, 256> told = {};
  const ssize_t length = ::pread(::fileno(file), told.data(), told.size(), 0);
  std::fclose(file);
  return {told.data(), static_cast<std::size_t>(std::max<ssize_t>(length, 0))};
}

std::string orphaned() { return "stopped it"; }

}  // namespace

TEST_CASE("a guardian acts when the other process is killed") {
  CHECK(told_by_guardian([](const auto&) { ::kill(::getpid(), SIGKILL); }, orphaned) ==
        "spindle: stopped it\n");
}

TEST_CASE("a guardian acts when the other process ends without a word") {
  CHECK(told_by_guardian([](const auto&) {}, orphaned) == "spindle: stopped it\n");
}

TEST_CASE("a guardian that hears that all is safe is gone when the word has been said") {
  CHECK(told_by_guardian(
            [](const auto& tell_safe) {
              tell_safe();
              if (::waitpid(-1, nullptr, WNOHANG) != -1 || errno != ECHILD) ::_exit(2);
            },
            orphaned)
            .empty());
}

TEST_CASE("a guardian survives what is sent to the terminal's processes") {
  const auto ends_badly = [](const auto&) {
    ::setpgid(0, 0);
    for (const int number : {SIGHUP, SIGINT, SIGTERM, SIGQUIT, SIGUSR1}) ::signal(number, SIG_IGN);
    for (const int number : {SIGHUP, SIGINT, SIGTERM, SIGQUIT, SIGUSR1}) ::kill(0, number);
    ::kill(::getpid(), SIGKILL);
  };
  CHECK(told_by_guardian(ends_badly, orphaned) == "spindle: stopped it\n");
}

TEST_CASE("a guardian holds no descriptor of the other process") {
  int other[2];
  REQUIRE(::pipe(other) == 0);
  const auto count_open = [&other]() -> std::string {
    const bool kept = ::fcntl(other[0], F_GETFD) != -1 || ::fcntl(other[1], F_GETFD) != -1;
    return kept ? "kept" : "closed";
  };
  CHECK(told_by_guardian([](const auto&) {}, count_open) == "spindle: closed\n");
  ::close(other[0]);
  ::close(other[1]);
}

TEST_CASE("a guardian whose work fails says so") {
  const auto fails = []() -> std::string { throw std::runtime_error("no memory"); };
  CHECK(told_by_guardian([](const auto&) {}, fails) ==
        "spindle: THE TOOL MAY STILL RUN: its guardian failed: no memory\n");
}
