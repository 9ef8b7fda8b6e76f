#include <fcntl.h>
#include <fmt/format.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <string>
#include <system_error>
#include <utility>

#include "posix/baud.hpp"
#include "posix/serving.hpp"
#include "spindle/posix/serve.hpp"

namespace spindle::posix {
namespace {

Error failed(std::string_view what, int error_number) {
  return {.code = Errc::port_unusable,
          .message = fmt::format("{}: {}", what, std::generic_category().message(error_number))};
}

/// The two ends of a pseudo terminal.
struct Terminal {
  Descriptor server;
  Descriptor client;  ///< held open, or the line would be gone whenever no client is there
  std::string path;
};

Result<Terminal> make_terminal(speed_t speed) {
  Terminal terminal{
      Descriptor(::posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC)), Descriptor(), {}};
  const int server = terminal.server.number();
  std::array<char, 128> path = {};
  if (!terminal.server.valid() || ::grantpt(server) != 0 || ::unlockpt(server) != 0 ||
      ::ptsname_r(server, path.data(), path.size()) != 0) {
    return tl::unexpected(failed("cannot make a pseudo terminal", errno));
  }
  terminal.path = path.data();
  terminal.client = Descriptor(::open(path.data(), O_RDWR | O_NOCTTY | O_CLOEXEC));
  termios settings = {};
  if (!terminal.client.valid() || ::tcgetattr(terminal.client.number(), &settings) != 0) {
    return tl::unexpected(failed(fmt::format("cannot open {}", terminal.path), errno));
  }
  // Nothing is echoed, edited or held back for a line's end, whatever the client sets or not.
  ::cfmakeraw(&settings);
  ::cfsetspeed(&settings, speed);
  ::tcsetattr(terminal.client.number(), TCSANOW, &settings);
  return terminal;
}

/// A symbolic link that is taken away at the end, unless another program has put something else
/// there.
class Link {
 public:
  static Result<Link> make(const std::string& path, const std::string& to) {
    if (::symlink(to.c_str(), path.c_str()) == 0) return Link(path, to);
    const int failure = errno;
    if (failure == EEXIST) {
      return tl::unexpected(
          Error{.code = Errc::port_busy,
                .message = fmt::format("{} exists already", path),
                .hint = "choose another path; a simulation that was killed may have left it"});
    }
    return tl::unexpected(failed(fmt::format("cannot make {}", path), failure));
  }
  ~Link() {
    std::array<char, 128> found = {};
    const ssize_t size = ::readlink(path_.c_str(), found.data(), found.size());
    if (size > 0 && std::string_view(found.data(), static_cast<std::size_t>(size)) == to_) {
      ::unlink(path_.c_str());
    }
  }
  Link(Link&& other) noexcept
      : path_(std::exchange(other.path_, {})), to_(std::exchange(other.to_, {})) {}
  Link& operator=(Link&&) = delete;
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;

 private:
  Link(std::string path, std::string to) : path_(std::move(path)), to_(std::move(to)) {}

  std::string path_;
  std::string to_;
};

}  // namespace

Result<void> serve_pty(sim::Server& server, const ServeOptions& options, const Clock& clock,
                       const Interrupt& interrupt) {
  const auto speed = options.baud == 0 ? std::optional<speed_t>(B9600) : speed_of(options.baud);
  if (!speed) {
    return tl::unexpected(Error{.code = Errc::port_unusable,
                                .message = fmt::format("no line does {} baud", options.baud),
                                .hint = "such as 9600 or 115200"});
  }
  TRY_LET(auto terminal, make_terminal(*speed));
  const auto link = Link::make(options.pty, terminal.path);
  if (!link) return tl::unexpected(link.error());
  if (options.listening) {
    TRY(options.listening(0));
  }
  Serving serving(Service{server, options}, clock, interrupt);
  serving.adopt(std::move(terminal.server), ServedClient::Wire::terminal);
  serving.run();
  return {};
}

}  // namespace spindle::posix
