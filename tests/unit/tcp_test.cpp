#include "spindle/posix/tcp.hpp"

#include <doctest/doctest.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <netdb.h>
#include <netinet/tcp.h>
#include <poll.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <numeric>
#include <string_view>
#include <thread>
#include <vector>

#include "posix/resolve.hpp"
#include "posix/socket_errors.hpp"
#include "spindle/posix/clock.hpp"
#include "unit/loopback.hpp"

using namespace spindle;
using namespace std::chrono_literals;
using posix::Descriptor;

namespace {

// An interrupt must be felt at once. A busy machine slows one attempt or another: the quickest is
// judged.
constexpr Duration at_once = 100ms;
constexpr int attempts = 5;
constexpr Duration patience = 5s;

/// How long after `raised` it is now, once the thread that raises has written that down.
Duration elapsed_behind(std::thread& raising, const TimePoint& raised, const Clock& clock) {
  const TimePoint ended = clock.now();
  raising.join();
  return ended - raised;
}

struct World {
  test::WakingInterrupt waking;
  posix::SteadyClock clock{waking.get()};

  Result<std::unique_ptr<link::Transport>> open(const std::string& host, std::uint16_t port,
                                                Duration timeout = patience) {
    return posix::open_tcp(host, port, timeout, clock, waking.get());
  }
  [[nodiscard]] TimePoint in(Duration duration) const { return clock.now() + duration; }
};

// Both ends of one connection: the transport under test and a plain socket.
struct Connected : World {
  Connected() {
    auto opened = open("127.0.0.1", acceptor.port());
    REQUIRE(opened.has_value());
    transport = std::move(*opened);
    tool = acceptor.accept();
    REQUIRE(tool.valid());
  }
  void tool_sends(std::string_view text) const {
    REQUIRE(::send(tool.number(), text.data(), text.size(), MSG_NOSIGNAL) ==
            static_cast<ssize_t>(text.size()));
  }
  void tool_resets() {
    const linger abort = {.l_onoff = 1, .l_linger = 0};
    ::setsockopt(tool.number(), SOL_SOCKET, SO_LINGER, &abort, sizeof abort);
    tool.close();
  }
  Result<std::string> receive(Duration timeout = patience) {
    std::array<std::uint8_t, 64> buffer = {};
    return transport->receive(buffer, in(timeout)).map([&buffer](std::size_t size) {
      return std::string(buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(size));
    });
  }

  test::Acceptor acceptor;
  Descriptor tool;
  std::unique_ptr<link::Transport> transport;
};

// A port of 127.0.0.1 on which connecting takes for ever: its queue is full.
class FullPort {
 public:
  FullPort() {
    constexpr int more_than_the_queue = 16;
    for (int i = 0; i < more_than_the_queue && !full_; ++i) fill();
  }
  [[nodiscard]] bool full() const { return full_; }
  [[nodiscard]] std::uint16_t port() const { return acceptor_.port(); }

 private:
  void fill() {
    Descriptor socket(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
    const sockaddr_in address = test::loopback_address(acceptor_.port());
    ::connect(socket.number(), reinterpret_cast<const sockaddr*>(&address), sizeof address);
    pollfd polled = {socket.number(), POLLOUT, 0};
    constexpr int loopback_needs_less_ms = 50;
    full_ = ::poll(&polled, 1, loopback_needs_less_ms) == 0;
    waiting_.push_back(std::move(socket));
  }

  test::Acceptor acceptor_{0};
  std::vector<Descriptor> waiting_;
  bool full_ = false;
};

// The descriptor of the socket in this process that is connected to the port.
int descriptor_connected_to(std::uint16_t port) {
  constexpr int enough = 1024;
  for (int descriptor = 0; descriptor < enough; ++descriptor) {
    sockaddr_in address = {};
    socklen_t size = sizeof address;
    const int failure = ::getpeername(descriptor, reinterpret_cast<sockaddr*>(&address), &size);
    if (failure == 0 && address.sin_family == AF_INET && ntohs(address.sin_port) == port) {
      return descriptor;
    }
  }
  return -1;
}

int option(int socket, int level, int name) {
  int value = -1;
  socklen_t size = sizeof value;
  ::getsockopt(socket, level, name, &value, &size);
  return value;
}

}  // namespace

TEST_CASE("connect errors: every cause is told apart") {
  struct Row {
    int error_number;
    Errc code;
    std::string_view message;  // empty: the table's text
  };
  const Row rows[] = {
      {ECONNREFUSED, Errc::connection_refused, ""},
      {ETIMEDOUT, Errc::connect_timeout, ""},
      {ENETUNREACH, Errc::no_route, ""},
      {EHOSTUNREACH, Errc::no_route, ""},
      {EHOSTDOWN, Errc::no_route, ""},
      {ENETDOWN, Errc::no_route, ""},
      {EACCES, Errc::no_route, "cannot connect: Permission denied"},
      {EAFNOSUPPORT, Errc::no_route, "cannot connect: Address family not supported by protocol"},
      {EADDRNOTAVAIL, Errc::no_route, "cannot connect: Cannot assign requested address"},
      {EMFILE, Errc::internal, "cannot open a socket: Too many open files"},
  };
  for (const Row& row : rows) {
    CAPTURE(row.error_number);
    const Error error = posix::connect_error(row.error_number);
    CHECK(error.code == row.code);
    CHECK(error.message == row.message);
    CHECK(error.target.empty());
  }
}

TEST_CASE("stream errors: a connection that breaks is a reset, with its cause") {
  struct Row {
    int error_number;
    std::string_view message;
  };
  const Row rows[] = {
      {ECONNRESET, "connection reset by the tool"},
      {EPIPE, "connection reset by the tool"},
      {ETIMEDOUT, "the connection broke: the tool no longer acknowledges what is sent"},
      {EHOSTUNREACH, "the connection broke: No route to host"},
      {ENETDOWN, "the connection broke: Network is down"},
  };
  for (const Row& row : rows) {
    CAPTURE(row.error_number);
    const Error error = posix::stream_error(row.error_number);
    CHECK(error.code == Errc::reset);
    CHECK(error.status() == ExitStatus::no_answer);
    CHECK(error.message == row.message);
  }
}

TEST_CASE("resolve errors: an unknown name is not a silent name server") {
  struct Row {
    int status;
    int error_number;
    std::string_view message;
  };
  const Row rows[] = {
      {EAI_NONAME, 0, "no address for 'foo'"},
      {EAI_NODATA, 0, "no address for 'foo'"},
      {EAI_AGAIN, 0, "no address for 'foo': the name server does not answer"},
      {EAI_FAIL, 0, "no address for 'foo': Non-recoverable failure in name resolution"},
      {EAI_SYSTEM, EMFILE, "no address for 'foo': Too many open files"},
  };
  for (const Row& row : rows) {
    CAPTURE(row.status);
    const Error error = posix::resolve_error(row.status, row.error_number, "foo");
    CHECK(error.code == Errc::name_not_found);
    CHECK(error.message == row.message);
  }
}

TEST_CASE("resolve: numeric addresses are known at once, names are looked up") {
  World world;
  struct Row {
    const char* host;
    const char* text;
  };
  for (const Row& row :
       {Row{"127.0.0.1", "127.0.0.1"}, Row{"::1", "::1"}, Row{"192.168.10.23", "192.168.10.23"},
        Row{"2001:db8::7", "2001:db8::7"}}) {
    CAPTURE(row.host);
    // The deadline is over: a numeric address does not wait.
    const auto resolved =
        posix::resolve(row.host, 5000, world.in(-1s), world.clock, world.waking.get());
    REQUIRE(resolved.has_value());
    CHECK(resolved->given == posix::Resolved::Given::address);
    REQUIRE(resolved->addresses.size() == 1);
    CHECK(posix::to_text(resolved->addresses.front()) == row.text);
    CHECK(posix::port_of(resolved->addresses.front()) == 5000);
  }
  const auto name =
      posix::resolve("localhost", 502, world.in(patience), world.clock, world.waking.get());
  REQUIRE(name.has_value());
  CHECK(name->given == posix::Resolved::Given::name);
  CHECK(posix::port_of(name->addresses.front()) == 502);
}

TEST_CASE("resolve: a look-up ends at the deadline and at an interrupt, and is left behind") {
  World world;
  const auto late =
      posix::resolve("no-such-host.invalid", 1, world.in(0s), world.clock, world.waking.get());
  REQUIRE_FALSE(late.has_value());
  CHECK(late.error().code == Errc::name_not_found);

  world.waking.raise(15);
  const auto interrupted =
      posix::resolve("localhost", 1, world.in(patience), world.clock, world.waking.get());
  REQUIRE_FALSE(interrupted.has_value());
  CHECK(interrupted.error().code == Errc::terminated);
}

TEST_CASE("open: a name that does not exist is not found") {
  World world;
  const auto opened = world.open("no-such-host.invalid", 5000, 2s);
  REQUIRE_FALSE(opened.has_value());
  CHECK(opened.error().code == Errc::name_not_found);
  CHECK(opened.error().status() == ExitStatus::unreachable);
  CHECK(opened.error().message.starts_with("no address for 'no-such-host.invalid'"));
}

TEST_CASE("open: bytes go both ways over an address and over a name") {
  for (const char* host : {"127.0.0.1", "localhost"}) {
    CAPTURE(host);
    World world;
    const test::Acceptor acceptor;
    const auto opened = world.open(host, acceptor.port());
    REQUIRE(opened.has_value());
    const Descriptor tool = acceptor.accept();
    const Bytes request = {1, 2, 3};
    REQUIRE((*opened)->send(request, world.in(patience)).has_value());
    Bytes got(8);
    REQUIRE(::recv(tool.number(), got.data(), got.size(), 0) == 3);
    CHECK(Bytes(got.begin(), got.begin() + 3) == request);
    REQUIRE(::send(tool.number(), request.data(), 2, MSG_NOSIGNAL) == 2);
    const auto size = (*opened)->receive(got, world.in(patience));
    REQUIRE(size.has_value());
    CHECK(*size == 2);
  }
}

TEST_CASE("open: the line behind a device server is used by one at a time") {
  World world;
  test::Acceptor acceptor;
  const auto open = [&](posix::Behind behind) {
    return posix::open_tcp("127.0.0.1", acceptor.port(), patience, world.clock, world.waking.get(),
                           behind);
  };
  auto first = open(posix::Behind::line);
  REQUIRE(first.has_value());
  CHECK((*first)->company().empty());

  const auto second = open(posix::Behind::line);
  REQUIRE_FALSE(second);
  CHECK(second.error().code == Errc::port_busy);
  CHECK(message_of(second.error()) ==
        fmt::format("the serial line behind 127.0.0.1 port {} is in use by this program itself",
                    acceptor.port()));
  CHECK(open(posix::Behind::tool).has_value());  // no line: each connection is its own

  const auto beside = open(posix::Behind::busy_line);  // to stop a motor
  REQUIRE(beside.has_value());
  CHECK((*beside)->company() == "this program itself");

  first->reset();
  CHECK(open(posix::Behind::line).has_value());
}

TEST_CASE("open: IPv6") {
  const Descriptor listener(::socket(AF_INET6, SOCK_STREAM | SOCK_CLOEXEC, 0));
  sockaddr_in6 address = {};
  address.sin6_family = AF_INET6;
  address.sin6_addr = in6addr_loopback;
  const auto* const generic = reinterpret_cast<const sockaddr*>(&address);
  if (::bind(listener.number(), generic, sizeof address) != 0) {
    MESSAGE("no IPv6 on this machine");
    return;
  }
  ::listen(listener.number(), 1);
  World world;
  CHECK(world.open("::1", test::local_port(listener.number())).has_value());
}

TEST_CASE("open: the socket is not inherited, quick, and notices a tool that is gone") {
  const Connected connected;
  const int socket = descriptor_connected_to(connected.acceptor.port());
  REQUIRE(socket >= 0);
  CHECK((::fcntl(socket, F_GETFD) & FD_CLOEXEC) != 0);
  CHECK((::fcntl(socket, F_GETFL) & O_NONBLOCK) != 0);
  CHECK(option(socket, IPPROTO_TCP, TCP_NODELAY) == 1);
  CHECK(option(socket, SOL_SOCKET, SO_KEEPALIVE) == 1);
  CHECK(option(socket, IPPROTO_TCP, TCP_KEEPIDLE) == 5);
  CHECK(option(socket, IPPROTO_TCP, TCP_KEEPINTVL) == 2);
  CHECK(option(socket, IPPROTO_TCP, TCP_KEEPCNT) == 3);
  CHECK(option(socket, IPPROTO_TCP, TCP_USER_TIMEOUT) == 10'000);
}

TEST_CASE("open: a port without a listener refuses; a name's address is told") {
  World world;
  const test::BoundSocket silent;
  const auto by_address = world.open("127.0.0.1", silent.port());
  REQUIRE_FALSE(by_address.has_value());
  CHECK(by_address.error().code == Errc::connection_refused);
  CHECK(message_of(by_address.error()) == "connection refused");

  const auto by_name = world.open("localhost", silent.port());
  REQUIRE_FALSE(by_name.has_value());
  CHECK(by_name.error().code == Errc::connection_refused);
  CHECK(message_of(by_name.error()).starts_with("connection refused (address "));
}

TEST_CASE("open: a connection that is never completed ends with the connect timeout") {
  const FullPort port;
  REQUIRE(port.full());
  World world;
  const TimePoint begun = world.clock.now();
  const auto opened = world.open("127.0.0.1", port.port(), 60ms);
  const Duration took = world.clock.now() - begun;
  REQUIRE_FALSE(opened.has_value());
  CHECK(opened.error().code == Errc::connect_timeout);
  CHECK(opened.error().waited == 60ms);
  CHECK(message_of(opened.error()) == "no connection within 60ms");
  CHECK(took >= 60ms);
}

TEST_CASE("open: an interrupt ends connecting at once") {
  const FullPort port;
  REQUIRE(port.full());
  Duration quickest = patience;
  for (int i = 0; i < attempts; ++i) {
    World world;
    TimePoint raised;
    std::thread other([&] {
      raised = world.clock.now();
      world.waking.raise(2);
    });
    const auto opened = world.open("127.0.0.1", port.port());
    quickest = std::min(quickest, elapsed_behind(other, raised, world.clock));
    REQUIRE_FALSE(opened.has_value());
    CHECK(opened.error().code == Errc::interrupted);
  }
  CHECK(quickest < at_once);
}

TEST_CASE("receive: bytes that are there are returned even after the deadline") {
  Connected connected;
  connected.tool_sends("abc");
  CHECK(connected.receive() == "abc");
  connected.tool_sends("def");
  const int socket = descriptor_connected_to(connected.acceptor.port());
  pollfd arrival = {socket, POLLIN, 0};
  REQUIRE(::poll(&arrival, 1, 5000) == 1);
  CHECK(connected.receive(-1s) == "def");
}

TEST_CASE("receive: nothing by the deadline is no error") {
  Connected connected;
  const TimePoint begun = connected.clock.now();
  CHECK(connected.receive(20ms) == "");
  CHECK(connected.clock.now() - begun >= 20ms);
  CHECK(connected.receive(-1s) == "");
}

TEST_CASE("receive: what was sent before the end arrives, then closed") {
  Connected connected;
  connected.tool_sends("last words");
  connected.tool.close();
  CHECK(connected.receive() == "last words");
  for (int again = 0; again < 2; ++again) {
    const auto result = connected.receive();
    REQUIRE_FALSE(result.has_value());
    CHECK(result.error().code == Errc::closed);
  }
}

TEST_CASE("receive: reset is told from closed") {
  Connected connected;
  connected.tool_resets();
  const auto result = connected.receive();
  REQUIRE_FALSE(result.has_value());
  CHECK(result.error().code == Errc::reset);
  CHECK(message_of(result.error()) == "connection reset by the tool");
}

TEST_CASE("receive: an interrupt ends the wait at once") {
  struct Row {
    int signal;
    Errc code;
  };
  for (const Row& row : {Row{2, Errc::interrupted}, Row{15, Errc::terminated}}) {
    CAPTURE(row.signal);
    Duration quickest = patience;
    for (int i = 0; i < attempts; ++i) {
      Connected connected;
      TimePoint raised;
      std::thread other([&] {
        raised = connected.clock.now();
        connected.waking.raise(row.signal);
      });
      const auto result = connected.receive();
      quickest = std::min(quickest, elapsed_behind(other, raised, connected.clock));
      REQUIRE_FALSE(result.has_value());
      CHECK(result.error().code == row.code);
    }
    CHECK(quickest < at_once);
  }
}

TEST_CASE("receive: an interrupt wins over data, until the transport is shielded") {
  Connected connected;
  connected.tool_sends("endless");
  connected.waking.raise(2);
  const auto result = connected.receive();
  REQUIRE_FALSE(result.has_value());
  CHECK(result.error().code == Errc::interrupted);
  const Bytes stop = {0};
  CHECK_FALSE(connected.transport->send(stop, connected.in(patience)).has_value());

  connected.transport->set_uninterruptible();
  CHECK(connected.receive() == "endless");
  CHECK(connected.receive(10ms) == "");
  CHECK(connected.transport->send(stop, connected.in(patience)).has_value());
}

TEST_CASE("send: more than the system buffers arrives whole while the tool reads") {
  Connected connected;
  Bytes sent(8'000'000);
  std::iota(sent.begin(), sent.end(), std::uint8_t{0});
  Bytes got;
  std::thread reader([&] {
    Bytes some(65536);
    ssize_t size = 0;
    while ((size = ::recv(connected.tool.number(), some.data(), some.size(), 0)) > 0) {
      got.insert(got.end(), some.begin(), some.begin() + size);
    }
  });
  const auto result = connected.transport->send(sent, connected.in(patience));
  connected.transport.reset();
  reader.join();
  CHECK(result.has_value());
  CHECK((got == sent));
}

TEST_CASE("send: a tool that takes nothing more is no answer, at the deadline") {
  Connected connected;
  const Bytes too_much(64'000'000);
  const TimePoint begun = connected.clock.now();
  const auto result = connected.transport->send(too_much, connected.in(50ms));
  REQUIRE_FALSE(result.has_value());
  CHECK(result.error().code == Errc::no_answer);
  CHECK(connected.clock.now() - begun >= 50ms);
}

TEST_CASE("send: an interrupt ends a send that is stuck") {
  Connected connected;
  std::thread other([&] { connected.waking.raise(15); });
  const auto result = connected.transport->send(Bytes(64'000'000), connected.in(patience));
  other.join();
  REQUIRE_FALSE(result.has_value());
  CHECK(result.error().code == Errc::terminated);
}

TEST_CASE("send: to a tool that is gone is a reset") {
  Connected connected;
  const int socket = descriptor_connected_to(connected.acceptor.port());
  connected.tool_resets();
  pollfd arrival = {socket, POLLIN, 0};
  REQUIRE(::poll(&arrival, 1, 5000) == 1);
  const Bytes request = {1};
  const auto result = connected.transport->send(request, connected.in(patience));
  REQUIRE_FALSE(result.has_value());
  CHECK(result.error().code == Errc::reset);
}
