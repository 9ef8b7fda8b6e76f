#include "spindle/posix/tcp.hpp"

#include <fmt/format.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <cerrno>

#include "posix/descriptor.hpp"
#include "posix/line_lock.hpp"
#include "posix/resolve.hpp"
#include "posix/socket_errors.hpp"
#include "posix/wait.hpp"

namespace spindle::posix {
namespace {

// A tool that lost its Wi-Fi says nothing. These let the system notice within about ten seconds:
// short enough that an operator still stands before the tool, long enough to roam between access
// points. An idle connection gets three probes after five seconds of silence; a busy one breaks
// after ten seconds without an acknowledgement, or old requests would pile up and reach the tool
// when it comes back.
constexpr int keep_alive_idle_s = 5;
constexpr int keep_alive_interval_s = 2;
constexpr int keep_alive_probes = 3;
constexpr unsigned user_timeout_ms = 10'000;

template <typename Value>
void set_option(const Descriptor& socket, int level, int option, Value value) {
  // Not checked: a connection without one of these still works.
  ::setsockopt(socket.number(), level, option, &value, sizeof value);
}

// After connecting: the user timeout would otherwise cut the connect timeout short.
void set_options(const Descriptor& socket) {
  set_option(socket, IPPROTO_TCP, TCP_NODELAY, 1);
  set_option(socket, SOL_SOCKET, SO_KEEPALIVE, 1);
  set_option(socket, IPPROTO_TCP, TCP_KEEPIDLE, keep_alive_idle_s);
  set_option(socket, IPPROTO_TCP, TCP_KEEPINTVL, keep_alive_interval_s);
  set_option(socket, IPPROTO_TCP, TCP_KEEPCNT, keep_alive_probes);
  set_option(socket, IPPROTO_TCP, TCP_USER_TIMEOUT, user_timeout_ms);
}

/// The line behind a port. Only that of a device server is locked.
struct Line {
  std::string known_as = {};  ///< what other programs call it
  std::string name = {};
  LineLock lock = {};
  TimePoint late_until = {};
};

class TcpTransport final : public link::Transport {
 public:
  TcpTransport(Descriptor socket, Line line, const Clock& clock, const Interrupt& interrupt)
      : socket_(std::move(socket)), line_(std::move(line)), wait_(clock, interrupt) {}

  Result<void> send(ByteView bytes, TimePoint deadline) override;
  Result<std::size_t> receive(std::span<std::uint8_t> into, TimePoint deadline) override;
  void set_uninterruptible() override { wait_.set_uninterruptible(); }
  void set_interruptible() override { wait_.set_interruptible(); }
  void wake() override { wait_.wake(); }
  [[nodiscard]] std::string line_name() const override { return line_.known_as; }
  [[nodiscard]] std::string company() const override { return line_.lock.holder; }
  [[nodiscard]] TimePoint late_until() const override { return line_.late_until; }
  void leave_late(TimePoint until) override {
    if (!line_.name.empty()) leave_late_answers({line_.name}, until);
  }

 private:
  Descriptor socket_;
  Line line_;
  LineWait wait_;
};

Result<void> TcpTransport::send(ByteView bytes, TimePoint deadline) {
  while (!bytes.empty()) {
    TRY(wait_.check());
    const ssize_t sent = ::send(socket_.number(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent >= 0) {
      bytes = bytes.subspan(static_cast<std::size_t>(sent));
      continue;
    }
    if (errno == EINTR) continue;
    if (errno != EAGAIN) return tl::unexpected(stream_error(errno));
    const Result<bool> ready = wait_.until_ready({socket_.number(), POLLOUT}, deadline);
    if (!ready) return tl::unexpected(ready.error());
    if (!*ready) {
      return tl::unexpected(
          Error{.code = Errc::no_answer, .message = "connected, but the tool takes no more data"});
    }
  }
  return {};
}

Result<std::size_t> TcpTransport::receive(std::span<std::uint8_t> into, TimePoint deadline) {
  for (;;) {
    // Before every read: an interrupt wins over data that never ends, too.
    TRY(wait_.check());
    const ssize_t received = ::recv(socket_.number(), into.data(), into.size(), 0);
    if (received > 0) return static_cast<std::size_t>(received);
    if (received == 0) return tl::unexpected(Error{.code = Errc::closed});
    if (errno == EINTR) continue;
    if (errno != EAGAIN) return tl::unexpected(stream_error(errno));
    const Result<bool> ready = wait_.until_ready({socket_.number(), POLLIN}, deadline);
    if (!ready) return tl::unexpected(ready.error());
    if (!*ready) return 0;
  }
}

int pending_error(const Descriptor& socket) {
  int error_number = 0;
  socklen_t size = sizeof error_number;
  ::getsockopt(socket.number(), SOL_SOCKET, SO_ERROR, &error_number, &size);
  return error_number;
}

Result<Descriptor> connect_to(const Address& address, TimePoint deadline, const Clock& clock,
                              const Interrupt& interrupt) {
  Descriptor socket(
      ::socket(address.storage.ss_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (!socket.valid()) return tl::unexpected(connect_error(errno));
  if (::connect(socket.number(), address.data(), address.size) == 0) return socket;
  // A signal does not stop a connect under way.
  if (errno != EINPROGRESS && errno != EINTR) return tl::unexpected(connect_error(errno));

  const Interest connected = {.descriptor = socket.number(), .events = POLLOUT};
  switch (wait_for(connected, deadline, clock, interrupt)) {
    case Woken::interrupted:
      return tl::unexpected(interrupt.error());
    case Woken::deadline:
      return tl::unexpected(connect_error(ETIMEDOUT));
    case Woken::ready:
      break;
  }
  const int failure = pending_error(socket);
  if (failure != 0) return tl::unexpected(connect_error(failure));
  return socket;
}

// Which of two addresses' failures says more. A name often has an IPv6 address that this computer
// has no route to; that must not hide what the IPv4 address said.
bool says_more(const Error& newer, const std::optional<Error>& older) {
  return !older || newer.code != Errc::no_route || older->code == Errc::no_route;
}

struct Attempt {
  TimePoint deadline;
  Duration allowed;
  Behind behind;
};

struct Connection {
  Descriptor socket;
  Line line = {};
};

std::string known_as(const Address& address, Behind behind) {
  return fmt::format("{}-{}-{}", behind == Behind::tool ? "tcp" : "rtu+tcp", to_text(address),
                     port_of(address));
}

Error busy_error(const Address& address, const LineLock& lock) {
  return {.code = Errc::port_busy,
          .message = fmt::format("the serial line behind {} port {} is in use by {}",
                                 to_text(address), port_of(address), lock.holder),
          .hint = "end the other program, or wait until it has ended"};
}

/// Locked before it is connected: some device servers drop the older of two connections.
Result<Connection> connect_line(const Address& address, const Attempt& attempt, TimePoint deadline,
                                const Clock& clock, const Interrupt& interrupt) {
  Line line{.known_as = known_as(address, attempt.behind)};
  if (attempt.behind != Behind::tool) {
    line.name = fmt::format("{}-{}", to_text(address), port_of(address));
    line.lock = lock_line(line.name);
    line.late_until = late_answers_until({line.name}, clock.now());
  }
  if (attempt.behind == Behind::line && !line.lock.holder.empty()) {
    return tl::unexpected(busy_error(address, line.lock));
  }
  return connect_to(address, deadline, clock, interrupt).map([&](Descriptor socket) {
    return Connection{std::move(socket), std::move(line)};
  });
}

Result<Connection> connect_to_any(const Resolved& resolved, const Attempt& attempt,
                                  const Clock& clock, const Interrupt& interrupt) {
  std::optional<Error> failure;
  auto untried = static_cast<std::int64_t>(resolved.addresses.size());
  for (const Address& address : resolved.addresses) {
    // An address that swallows everything must leave time for those after it.
    const TimePoint now = clock.now();
    const TimePoint share = now + (attempt.deadline - now) / untried--;
    Result<Connection> connection = connect_line(address, attempt, share, clock, interrupt);
    if (connection) return connection;
    if (interrupt.raised()) return tl::unexpected(interrupt.error());

    Error error = std::move(connection.error());
    if (error.code == Errc::port_busy) return tl::unexpected(std::move(error));
    if (error.code == Errc::connect_timeout) error.waited = attempt.allowed;
    if (resolved.given == Resolved::Given::name) {
      error.message = fmt::format("{} (address {})", message_of(error), to_text(address));
    }
    if (says_more(error, failure)) failure = std::move(error);
  }
  return tl::unexpected(failure.value_or(Error{.code = Errc::no_route}));
}

}  // namespace

Result<std::unique_ptr<link::Transport>> open_tcp(const std::string& host, std::uint16_t port,
                                                  Duration connect_timeout, Clock& clock,
                                                  const Interrupt& interrupt, Behind behind,
                                                  const AskOwner& ask) {
  const Attempt attempt = {
      .deadline = clock.now() + connect_timeout, .allowed = connect_timeout, .behind = behind};
  const Result<Resolved> resolved = resolve(host, port, attempt.deadline, clock, interrupt);
  if (!resolved) return tl::unexpected(resolved.error());
  for (const Address& address : resolved->addresses) {
    if (!ask) break;
    if (auto asked = ask(known_as(address, behind))) return std::move(*asked);
  }
  Result<Connection> connection = connect_to_any(*resolved, attempt, clock, interrupt);
  if (!connection) return tl::unexpected(std::move(connection.error()));
  set_options(connection->socket);
  return std::make_unique<TcpTransport>(std::move(connection->socket), std::move(connection->line),
                                        clock, interrupt);
}

}  // namespace spindle::posix
