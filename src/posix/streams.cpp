#include "spindle/posix/streams.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <climits>
#include <cstdlib>
#include <string>
#include <system_error>

#include "posix/wait.hpp"
#include "posix/write_whole.hpp"

namespace spindle::posix {

bool hold_standard_descriptors() {
  for (const int number : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (::fcntl(number, F_GETFD) != -1) continue;
    // Opened the wrong way round: its user is told so, as if it were closed still.
    const int direction = number == STDIN_FILENO ? O_WRONLY : O_RDONLY;
    if (::open("/dev/null", direction) != number) return false;  // the lowest free one
  }
  return true;
}

namespace {

Result<void> out_result(int failure) {
  if (failure == 0) return {};
  if (failure == EPIPE) return tl::unexpected(Error{.code = Errc::closed_pipe});
  return tl::unexpected(Error{
      .code = Errc::storage,
      .message = "standard output cannot be written: " + std::generic_category().message(failure),
  });
}

bool out_is_file() {
  struct stat about = {};
  return ::fstat(STDOUT_FILENO, &about) == 0 && S_ISREG(about.st_mode);
}

}  // namespace

Result<void> write_out(std::string_view text) {
  return out_result(write_whole(STDOUT_FILENO, text, WhenFull::wait));
}

Result<std::size_t> write_out_for(std::string_view text, Duration patience) {
  if (out_is_file()) return write_out(text).map([&] { return text.size(); });
  pollfd room = {STDOUT_FILENO, POLLOUT, 0};
  const timespec longest = to_timespec(patience);
  if (::ppoll(&room, 1, &longest, nullptr) <= 0) return 0;
  // A pipe that has room takes so much at once.
  const std::string_view piece = text.substr(0, PIPE_BUF);
  const ssize_t written = ::write(STDOUT_FILENO, piece.data(), piece.size());
  if (written >= 0) return static_cast<std::size_t>(written);
  if (errno == EAGAIN || errno == EINTR) return 0;
  return out_result(errno).map([] { return std::size_t{0}; });
}

void write_err(std::string_view text) { write_whole(STDERR_FILENO, text, WhenFull::wait); }

namespace {

std::optional<std::string> read_line(const Clock& clock, const Interrupt& interrupt) {
  // Byte by byte: what follows the line belongs to the next reader of standard input.
  std::string line;
  char byte = 0;
  for (;;) {
    // A user who presses Ctrl-C at a question wants out, also just before the wait begins.
    const Woken woken = wait_for({STDIN_FILENO, POLLIN}, TimePoint::max(), clock, interrupt);
    const ssize_t got = woken == Woken::ready ? ::read(STDIN_FILENO, &byte, 1) : -1;
    // Another reader of a shared pipe was faster; where the wait itself ended, so does the
    // question.
    if (got < 0 && woken == Woken::ready && (errno == EAGAIN || errno == EINTR)) continue;
    if (got < 0) return std::nullopt;
    if (got == 0) break;
    if (byte == '\n') return line;
    line += byte;
  }
  if (line.empty()) return std::nullopt;
  return line;
}

}  // namespace

std::function<std::optional<std::string>()> line_reader(const Clock& clock,
                                                        const Interrupt& interrupt) {
  return [&clock, &interrupt] { return read_line(clock, interrupt); };
}

bool is_terminal(Std stream) {
  switch (stream) {
    case Std::in:
      return ::isatty(STDIN_FILENO) == 1;
    case Std::out:
      return ::isatty(STDOUT_FILENO) == 1;
    case Std::err:
      return ::isatty(STDERR_FILENO) == 1;
  }
  return false;
}

bool out_ends_within_line() { return ends_within_line(STDOUT_FILENO); }

bool err_is_ready() {
  pollfd room = {STDERR_FILENO, POLLOUT, 0};
  return ::poll(&room, 1, 0) != 0;
}

bool err_is_journal() {
  const char* const value = std::getenv("JOURNAL_STREAM");
  struct stat about = {};
  if (value == nullptr || ::fstat(STDERR_FILENO, &about) != 0) return false;
  return std::to_string(about.st_dev) + ":" + std::to_string(about.st_ino) == value;
}

namespace {

winsize window_of(int descriptor) {
  winsize size = {};
  return ::ioctl(descriptor, TIOCGWINSZ, &size) == 0 ? size : winsize();
}

}  // namespace

std::size_t err_columns() { return window_of(STDERR_FILENO).ws_col; }

std::size_t err_rows() { return window_of(STDERR_FILENO).ws_row; }

std::size_t out_columns() { return window_of(STDOUT_FILENO).ws_col; }

bool out_is_open() {
  pollfd reader = {STDOUT_FILENO, 0, 0};
  return ::poll(&reader, 1, 0) <= 0 || (reader.revents & (POLLERR | POLLHUP)) == 0;
}

}  // namespace spindle::posix
