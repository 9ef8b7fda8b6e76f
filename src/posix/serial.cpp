#include "spindle/posix/serial.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/serial.h>
#include <modbus.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <termios.h>

#include <cerrno>
#include <filesystem>
#include <optional>
#include <system_error>
#include <utility>

#include "posix/baud.hpp"
#include "posix/descriptor.hpp"
#include "posix/line_lock.hpp"
#include "posix/port_holder.hpp"
#include "posix/wait.hpp"

namespace spindle::posix {
namespace {

std::string words(int error_number) { return std::generic_category().message(error_number); }

Error busy_error(const std::string& path, int descriptor) {
  const std::string holder = port_holder(path, descriptor);
  Error error{.code = Errc::port_busy};
  if (!holder.empty()) {
    error.message = fmt::format("the serial port is in use by {}", holder);
    error.hint = "close the other program, or wait until it has ended";
    if (holder.starts_with("spindle ")) {
      error.hint += "; a 'remote-start' stops its motor on Ctrl-C or 'kill -INT'";
    }
  }
  return error;
}

Error open_error(int error_number, const std::string& path) {
  switch (error_number) {
    case ENOENT:
    case ENOTDIR:
    case ENXIO:
    case ENODEV:
      return {.code = Errc::port_missing, .message = fmt::format("there is no {}", path)};
    case EBUSY:
      return busy_error(path, -1);
    case EACCES:
    case EPERM:
      return {.code = Errc::port_unusable,
              .message = fmt::format("no permission to open {}", path),
              .hint = "'sudo usermod -aG dialout $USER' lets you from the next login on"};
    case EISDIR:
    case ENOTTY:
      return {.code = Errc::port_unusable,
              .message = fmt::format("{} is not a serial port", path),
              .hint = "'ls /dev/serial/by-id' shows the ones that are plugged in"};
    default:
      return {.code = Errc::port_unusable,
              .message = fmt::format("cannot open {}: {}", path, words(error_number))};
  }
}

Error lacks(std::string setting) {
  return {.code = Errc::port_unusable,
          .message = fmt::format("the serial port does not do {}", setting),
          .hint = "check baud, parity and stop in the target, and what the adapter can do"};
}

/// A pseudo terminal has no parity; the kernel drops it without an error.
bool is_pseudo_terminal(int descriptor) {
  constexpr unsigned first_major = 136;  // Linux: Documentation/admin-guide/devices.txt
  constexpr unsigned last_major = 143;
  struct stat status = {};
  if (::fstat(descriptor, &status) != 0) return false;
  return ::major(status.st_rdev) >= first_major && ::major(status.st_rdev) <= last_major;
}

bool has_parity(const termios& found, modbus::Parity parity) {
  if ((found.c_cflag & PARENB) == 0) return parity == modbus::Parity::none;
  const bool odd = (found.c_cflag & PARODD) != 0;
  return parity == (odd ? modbus::Parity::odd : modbus::Parity::even);
}

enum class Terminal : std::uint8_t { real, pseudo };

/// Whether the port does what it was told.
Result<void> check_settings(const termios& found, const modbus::SerialSettings& wanted,
                            Terminal terminal) {
  const auto speed = speed_of(wanted.baud);
  const bool rate_taken =
      speed && ::cfgetospeed(&found) == *speed && ::cfgetispeed(&found) == *speed;
  if (!rate_taken) return tl::unexpected(lacks(fmt::format("{} baud", wanted.baud)));
  if ((found.c_cflag & CSIZE) != CS8) return tl::unexpected(lacks("eight data bits"));
  const bool two_stop_bits = (found.c_cflag & CSTOPB) != 0;
  if (two_stop_bits != (wanted.stop_bits == 2)) {
    return tl::unexpected(lacks(fmt::format("{} stop bits", wanted.stop_bits)));
  }
  const bool dropped = terminal == Terminal::pseudo && (found.c_cflag & PARENB) == 0;
  if (!dropped && !has_parity(found, wanted.parity)) {
    const bool none = wanted.parity == modbus::Parity::none;
    return tl::unexpected(
        lacks(fmt::format("{} parity", none ? "no" : modbus::parity_words.text(wanted.parity))));
  }
  return {};
}

struct FreeModbus {
  void operator()(modbus_t* context) const { modbus_free(context); }
};
using Modbus = std::unique_ptr<modbus_t, FreeModbus>;

/// Lets libmodbus open and set the port; all that it is ever asked. errno tells why it did not.
Modbus connect(const std::string& path, const modbus::SerialSettings& settings,
               modbus::Parity parity) {
  const char letter = parity == modbus::Parity::none  ? 'N'
                      : parity == modbus::Parity::odd ? 'O'
                                                      : 'E';
  Modbus context(modbus_new_rtu(path.c_str(), static_cast<int>(settings.baud), letter, 8,
                                static_cast<int>(settings.stop_bits)));
  if (context && modbus_connect(context.get()) != 0) {
    const int failure = errno;
    context.reset();
    errno = failure;
  }
  return context;
}

/// The port as it was found, and its lock: both are given back at the end.
class Port {
 public:
  static Result<Port> open(const std::string& path);
  Port(Port&&) noexcept = default;
  Port& operator=(Port&&) = delete;
  Port(const Port&) = delete;
  Port& operator=(const Port&) = delete;
  ~Port();

  Result<void> set(const std::string& path, const modbus::SerialSettings& settings);
  Result<void> switch_by_kernel();
  [[nodiscard]] int number() const { return modbus_get_socket(line_.get()); }

 private:
  Port(Descriptor lock, const termios& before) : lock_(std::move(lock)), before_(before) {}

  Descriptor lock_;
  termios before_;
  std::optional<serial_rs485> switching_before_ = std::nullopt;
  Modbus line_ = nullptr;
};

Result<Port> Port::open(const std::string& path) {
  // Opened and locked before anything is set: another program's line must not change its rate.
  Descriptor lock(::open(path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (!lock.valid()) return tl::unexpected(open_error(errno, path));
  termios before = {};
  if (::tcgetattr(lock.number(), &before) != 0) {
    return tl::unexpected(open_error(errno == EINVAL ? ENOTTY : errno, path));
  }
  if (::flock(lock.number(), LOCK_EX | LOCK_NB) != 0) {
    return tl::unexpected(errno == EWOULDBLOCK ? busy_error(path, lock.number())
                                               : open_error(errno, path));
  }
  return Port(std::move(lock), before);
}

Result<void> Port::set(const std::string& path, const modbus::SerialSettings& settings) {
  if (!speed_of(settings.baud)) {
    return tl::unexpected(lacks(fmt::format("{} baud", settings.baud)));
  }
  const Terminal terminal = is_pseudo_terminal(lock_.number()) ? Terminal::pseudo : Terminal::real;
  line_ = connect(path, settings, settings.parity);
  // glibc calls it an error when a terminal was told a parity, dropped it, and changed nothing
  // else.
  if (!line_ && errno == EINVAL && terminal == Terminal::pseudo) {
    line_ = connect(path, settings, modbus::Parity::none);
  }
  if (!line_) return tl::unexpected(open_error(errno, path));
  ::fcntl(number(), F_SETFD, FD_CLOEXEC);
  termios found = {};
  if (::tcgetattr(number(), &found) != 0) return tl::unexpected(open_error(errno, path));
  auto checked = check_settings(found, settings, terminal);
  if (checked) ::ioctl(number(), TIOCEXCL);
  return checked;
}

/// RTS is raised while sending. Delays stay as the system set them.
Result<void> Port::switch_by_kernel() {
  serial_rs485 switching = {};
  if (::ioctl(number(), TIOCGRS485, &switching) == 0) {
    switching_before_ = switching;
    switching.flags |= SER_RS485_ENABLED | SER_RS485_RTS_ON_SEND;
    switching.flags &= ~static_cast<unsigned>(SER_RS485_RTS_AFTER_SEND);
    if (::ioctl(number(), TIOCSRS485, &switching) == 0) return {};
  }
  switching_before_.reset();
  return tl::unexpected(
      Error{.code = Errc::port_unusable,
            .message = "the serial port has no RS-485 mode",
            .hint = "leave rs485 out of the target: most adapters switch by themselves"});
}

Port::~Port() {
  if (!lock_.valid()) return;
  if (line_) {
    if (switching_before_) ::ioctl(number(), TIOCSRS485, &*switching_before_);
    ::ioctl(number(), TIOCNXCL);
    modbus_close(line_.get());
  }
  // libmodbus puts back what it found, which on its second attempt was its own first one.
  ::tcsetattr(lock_.number(), TCSANOW, &before_);
}

/// The same by whatever name the port is called, and another one once it was plugged in anew.
LineName name_of(const std::string& path) {
  std::error_code unresolved;
  const auto real = std::filesystem::canonical(path, unresolved);
  struct stat port = {};
  if (unresolved || ::stat(real.c_str(), &port) != 0) return {.text = path};
  constexpr std::int64_t nanoseconds = 1'000'000'000;
  return {.text = real.string(),
          .since = std::int64_t{port.st_ctim.tv_sec} * nanoseconds + port.st_ctim.tv_nsec};
}

class SerialTransport final : public link::Transport {
 public:
  SerialTransport(Port port, LineName name, std::string company, const Clock& clock,
                  const Interrupt& interrupt)
      : port_(std::move(port)),
        name_(std::move(name)),
        company_(std::move(company)),
        late_until_(late_answers_until(name_, clock.now())),
        wait_(clock, interrupt) {}

  Result<void> send(ByteView bytes, TimePoint deadline) override;
  Result<std::size_t> receive(std::span<std::uint8_t> into, TimePoint deadline) override;
  void set_uninterruptible() override { wait_.set_uninterruptible(); }
  void set_interruptible() override { wait_.set_interruptible(); }
  void wake() override { wait_.wake(); }
  [[nodiscard]] std::string line_name() const override { return "rtu-" + name_.text; }
  [[nodiscard]] std::string company() const override { return company_; }
  [[nodiscard]] TimePoint late_until() const override { return late_until_; }
  void leave_late(TimePoint until) override { leave_late_answers(name_, until); }

 private:
  [[nodiscard]] bool hung_up() const;
  [[nodiscard]] Result<bool> wait_behind(ssize_t outcome, short event, TimePoint deadline) const;
  Result<void> drain() const;

  Port port_;
  LineName name_;
  std::string company_;
  TimePoint late_until_;
  LineWait wait_;
};

Error unplugged_error(int error_number) {
  return {.code = Errc::reset,
          .message = fmt::format("the serial port is gone ({})", words(error_number)),
          .hint = "was the adapter pulled out? plug it in and try again"};
}

bool SerialTransport::hung_up() const {
  pollfd port = {.fd = port_.number(), .events = 0, .revents = 0};
  return ::poll(&port, 1, 0) > 0 && (port.revents & (POLLHUP | POLLERR | POLLNVAL)) != 0;
}

/// Behind a read or write that moved no bytes: whether another is worth trying before the deadline.
Result<bool> SerialTransport::wait_behind(ssize_t outcome, short event, TimePoint deadline) const {
  if (outcome < 0 && errno == EINTR) return true;
  if (outcome < 0 && errno != EAGAIN) return tl::unexpected(unplugged_error(errno));
  // No bytes is what a port says both when there are none and when it is gone.
  if (hung_up()) return tl::unexpected(unplugged_error(EIO));
  return wait_.until_ready({port_.number(), event}, deadline);
}

Result<void> SerialTransport::send(ByteView bytes, TimePoint deadline) {
  while (!bytes.empty()) {
    TRY(wait_.check());
    const ssize_t sent = ::write(port_.number(), bytes.data(), bytes.size());
    if (sent > 0) {
      bytes = bytes.subspan(static_cast<std::size_t>(sent));
      continue;
    }
    const Result<bool> ready = wait_behind(sent, POLLOUT, deadline);
    if (!ready) return tl::unexpected(ready.error());
    if (!*ready) {
      return tl::unexpected(
          Error{.code = Errc::no_answer, .message = "the serial port takes no more data"});
    }
  }
  return drain();
}

Result<void> SerialTransport::drain() const {
  while (::tcdrain(port_.number()) != 0) {
    if (errno != EINTR) return tl::unexpected(unplugged_error(errno));
    TRY(wait_.check());
  }
  return {};
}

Result<std::size_t> SerialTransport::receive(std::span<std::uint8_t> into, TimePoint deadline) {
  for (;;) {
    // Before every read: an interrupt wins over data that never ends, too.
    TRY(wait_.check());
    const ssize_t received = ::read(port_.number(), into.data(), into.size());
    if (received > 0) return static_cast<std::size_t>(received);
    const Result<bool> ready = wait_behind(received, POLLIN, deadline);
    if (!ready) return tl::unexpected(ready.error());
    if (!*ready) return 0;
  }
}

}  // namespace

std::string serial_line_name(const std::string& path) { return "rtu-" + name_of(path).text; }

Result<std::unique_ptr<link::Transport>> open_serial(const std::string& path,
                                                     const modbus::SerialSettings& settings,
                                                     link::LineSwitching switching,
                                                     const Clock& clock,
                                                     const Interrupt& interrupt) {
  TRY_LET(auto port, Port::open(path));
  TRY(port.set(path, settings));
  if (switching == link::LineSwitching::kernel) {
    TRY(port.switch_by_kernel());
  }
  return std::make_unique<SerialTransport>(std::move(port), name_of(path), port_company(path),
                                           clock, interrupt);
}

}  // namespace spindle::posix
