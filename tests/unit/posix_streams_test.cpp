#include <doctest/doctest.h>
#include <fcntl.h>
#include <sys/resource.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <string>

#include "posix/descriptor.hpp"
#include "spindle/posix/clock.hpp"
#include "spindle/posix/signals.hpp"
#include "spindle/posix/streams.hpp"

using namespace spindle;
using posix::Descriptor;

namespace {

struct Pipe {
  Pipe() {
    std::array<int, 2> ends = {-1, -1};
    if (::pipe2(ends.data(), O_CLOEXEC) == 0) {
      reader = Descriptor(ends[0]);
      writer = Descriptor(ends[1]);
    }
  }
  Descriptor reader;
  Descriptor writer;
};

/// A file that can only be written, as behind '>' and '>>' in a shell, and is gone at the end.
class TemporaryFile {
 public:
  explicit TemporaryFile(int flags) {
    const Descriptor made(::mkstemp(name_.data()));
    writer = Descriptor(::open(name_.c_str(), O_WRONLY | O_CLOEXEC | flags));
  }
  ~TemporaryFile() { ::unlink(name_.c_str()); }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  [[nodiscard]] std::string text() const {
    std::ifstream file(name_);
    return {std::istreambuf_iterator<char>(file), {}};
  }

  Descriptor writer;

 private:
  std::string name_ = (std::filesystem::temp_directory_path() / "spindle-out-XXXXXX").string();
};

void put(const Descriptor& descriptor, std::string_view text) {
  REQUIRE(::write(descriptor.number(), text.data(), text.size()) ==
          static_cast<ssize_t>(text.size()));
}

std::string read_all(const Descriptor& descriptor) {
  std::string all;
  std::array<char, 65536> some;
  ssize_t got = 0;
  while ((got = ::read(descriptor.number(), some.data(), some.size())) > 0) {
    all.append(some.data(), static_cast<std::size_t>(got));
  }
  return all;
}

/// Seconds after which a child that hangs is ended; only a test that has failed waits so long.
constexpr unsigned longest_wait = 120;

// Runs `body` in a child in which `standard` is `descriptor`; the child's exit status is what
// `body` returns. The test's own streams stay as they are.
pid_t start(int standard, int descriptor, const std::function<int()>& body) {
  // What the test runner has not written yet must not be written by the child.
  std::fflush(nullptr);
  const pid_t child = ::fork();
  if (child != 0) return child;
  ::alarm(longest_wait);
  ::signal(SIGPIPE, SIG_IGN);
  ::dup2(descriptor, standard);
  ::_exit(body());
}

int finish(pid_t child) {
  int status = -1;
  ::waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

}  // namespace

TEST_CASE("streams: everything is written, also more than a pipe holds at once") {
  for (const int flags : {0, O_NONBLOCK}) {
    CAPTURE(flags);
    Pipe pipe;
    ::fcntl(pipe.writer.number(), F_SETFL, flags);
    const std::string text(300'000, 'x');
    const pid_t child = start(STDOUT_FILENO, pipe.writer.number(),
                              [&text] { return posix::write_out(text).has_value() ? 0 : 1; });
    pipe.writer.close();
    CHECK((read_all(pipe.reader) == text));
    CHECK(finish(child) == 0);
  }
}

TEST_CASE("streams: so is what is said on standard error") {
  for (const int flags : {0, O_NONBLOCK}) {
    CAPTURE(flags);
    Pipe pipe;
    ::fcntl(pipe.writer.number(), F_SETFL, flags);
    const std::string text(300'000, 'x');
    const pid_t child = start(STDERR_FILENO, pipe.writer.number(), [&text] {
      posix::write_err(text);
      return 0;
    });
    pipe.writer.close();
    CHECK((read_all(pipe.reader) == text));
    CHECK(finish(child) == 0);
  }
}

TEST_CASE("streams: a reader that is gone is closed_pipe, and status 0") {
  Pipe pipe;
  pipe.reader.close();
  const pid_t child = start(STDOUT_FILENO, pipe.writer.number(), [] {
    const Result<void> result = posix::write_out("x");
    const bool expected = !result && result.error().code == Errc::closed_pipe;
    return expected && result.error().status() == ExitStatus::ok ? 0 : 1;
  });
  CHECK(finish(child) == 0);
}

TEST_CASE("streams: a full disk is told in the system's words") {
  const Descriptor full(::open("/dev/full", O_WRONLY | O_CLOEXEC));
  REQUIRE(full.valid());
  const pid_t child = start(STDOUT_FILENO, full.number(), [] {
    const Result<void> result = posix::write_out("x");
    const bool expected =
        !result && result.error().status() == ExitStatus::storage &&
        result.error().message == "standard output cannot be written: No space left on device";
    return expected ? 0 : 1;
  });
  CHECK(finish(child) == 0);
}

TEST_CASE("streams: a file takes a text whole or not at all") {
  struct Case {
    int flags;
    std::string before;
  };
  const Case cases[] = {{0, ""}, {O_APPEND, ""}, {0, "one line\n"}, {O_APPEND, "one line\n"}};
  for (const Case& row : cases) {
    CAPTURE(row.flags);
    CAPTURE(row.before);
    const TemporaryFile file(row.flags);
    put(file.writer, row.before);
    const pid_t child = start(STDOUT_FILENO, file.writer.number(), [] {
      // As on a full disk: the beginning fits, the rest does not.
      const rlimit limit = {30, 30};
      ::setrlimit(RLIMIT_FSIZE, &limit);
      ::signal(SIGXFSZ, SIG_IGN);
      const std::string line(40, 'x');
      if (posix::write_out(line).has_value()) return 1;
      // What fits goes where it belongs.
      return posix::write_out("fits\n").has_value() ? 0 : 2;
    });
    CHECK(finish(child) == 0);
    CHECK(file.text() == row.before + "fits\n");
  }
}

TEST_CASE("streams: what another program wrote behind a cut line stays") {
  const TemporaryFile file(O_APPEND);
  const pid_t child = start(STDOUT_FILENO, file.writer.number(), [&file] {
    const rlimit limit = {30, 30};
    ::setrlimit(RLIMIT_FSIZE, &limit);
    ::signal(SIGXFSZ, SIG_IGN);
    put(file.writer, "the other one\n");
    return posix::write_out(std::string(40, 'x')).has_value() ? 1 : 0;
  });
  CHECK(finish(child) == 0);
  CHECK(file.text() == "the other one\n");
}

TEST_CASE("streams: a file that ends within a line is known as such") {
  struct Case {
    std::string text;
    bool within;
  };
  for (const Case& row : {Case{"", false}, Case{"a line\n", false}, Case{"a li", true}}) {
    for (const int flags : {0, O_APPEND}) {
      CAPTURE(row.text);
      CAPTURE(flags);
      const TemporaryFile file(flags);
      put(file.writer, row.text);
      const pid_t child = start(STDOUT_FILENO, file.writer.number(),
                                [] { return posix::out_ends_within_line() ? 1 : 0; });
      CHECK(finish(child) == (row.within ? 1 : 0));
    }
  }
  Pipe pipe;
  CHECK(finish(start(STDOUT_FILENO, pipe.writer.number(),
                     [] { return posix::out_ends_within_line() ? 1 : 0; })) == 0);
}

TEST_CASE("streams: messages go to standard error, and a closed one is no harm") {
  Pipe pipe;
  const pid_t child = start(STDERR_FILENO, pipe.writer.number(), [] {
    posix::write_err("spindle: oops\n");
    return 0;
  });
  pipe.writer.close();
  CHECK(read_all(pipe.reader) == "spindle: oops\n");
  CHECK(finish(child) == 0);

  Pipe broken;
  broken.reader.close();
  CHECK(finish(start(STDERR_FILENO, broken.writer.number(), [] {
          posix::write_err("this is not heard");
          return 0;
        })) == 0);
}

TEST_CASE("streams: lines are read without their end, the last one also without one") {
  Pipe pipe;
  put(pipe.writer, "yes\n\nlast");
  pipe.writer.close();
  const pid_t child = start(STDIN_FILENO, pipe.reader.number(), [] {
    const posix::SignalWatch signals;
    const posix::SteadyClock clock(signals.interrupt());
    const auto read_line = posix::line_reader(clock, signals.interrupt());
    if (read_line() != "yes") return 1;
    if (read_line() != "") return 2;
    if (read_line() != "last") return 3;
    return read_line().has_value() ? 4 : 0;
  });
  CHECK(finish(child) == 0);
}

TEST_CASE("streams: a signal at the prompt is never an answer, nor one just before it") {
  Pipe pipe;
  put(pipe.writer, "y");
  for (const bool early : {false, true}) {
    const pid_t child = start(STDIN_FILENO, pipe.reader.number(), [early] {
      const posix::SignalWatch signals;
      const posix::SteadyClock clock(signals.interrupt());
      struct sigaction action = {};
      action.sa_handler = [](int) { ::raise(SIGINT); };
      ::sigaction(SIGALRM, &action, nullptr);
      if (early) ::raise(SIGINT);
      const itimerval timer = {.it_interval = {}, .it_value = {.tv_sec = 0, .tv_usec = 20'000}};
      if (!early) ::setitimer(ITIMER_REAL, &timer, nullptr);
      return posix::line_reader(clock, signals.interrupt())().has_value() ? 1 : 0;
    });
    CHECK(finish(child) == 0);
  }
}

TEST_CASE("streams: a pipe is no terminal") {
  Pipe pipe;
  const pid_t child = start(STDIN_FILENO, pipe.reader.number(), [&pipe] {
    ::dup2(pipe.writer.number(), STDOUT_FILENO);
    ::dup2(pipe.writer.number(), STDERR_FILENO);
    const bool any = posix::is_terminal(posix::Std::in) || posix::is_terminal(posix::Std::out) ||
                     posix::is_terminal(posix::Std::err);
    return any ? 1 : 0;
  });
  CHECK(finish(child) == 0);
}
