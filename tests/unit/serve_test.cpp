#include "spindle/posix/serve.hpp"

#include <doctest/doctest.h>
#include <netinet/in.h>

#include <atomic>
#include <future>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "posix/socket_errors.hpp"
#include "spindle/modbus/pdu.hpp"
#include "spindle/posix/clock.hpp"
#include "spindle/posix/tcp.hpp"
#include "unit/loopback.hpp"

using namespace spindle;
using namespace std::chrono_literals;
using modbus::Adu;
using modbus::Pdu;
using modbus::RegisterAddress;
using modbus::RegisterTable;
using posix::Descriptor;
using posix::ServeOptions;

namespace {

constexpr Duration patience = 5s;

// Reads answer with the connection's number. Writing N to a register makes the tool push N events
// to every client a little later, by itself.
class EchoTool final : public sim::Server {
 public:
  std::optional<Pdu> answer(sim::ConnectionId connection, modbus::UnitId, const Pdu& request,
                            TimePoint now) override {
    advance(now);
    const auto parsed = modbus::parse_request(request);
    if (!parsed) return modbus::exception_response(request.function, 1);
    if (const auto* read = std::get_if<modbus::ReadRequest>(&*parsed)) {
      const Registers registers(read->count, static_cast<std::uint16_t>(connection.value));
      return modbus::read_response(read->table, registers);
    }
    if (const auto* write = std::get_if<modbus::WriteSingleRequest>(&*parsed)) {
      pushes_per_client_ = write->value;
      push_at_ = now + 5ms;
      return request;
    }
    return std::nullopt;
  }
  void advance(TimePoint now) override {
    if (!push_at_ || now < *push_at_) return;
    push_at_.reset();
    const Registers event(modbus::max_read_count, 0x1234);
    for (const std::uint32_t client : present_) {
      for (int i = 0; i < pushes_per_client_; ++i) {
        pushes_.push_back({{client}, modbus::read_response(RegisterTable::input, event)});
      }
    }
  }
  [[nodiscard]] std::optional<TimePoint> next_change() const override { return push_at_; }
  std::vector<sim::Push> take_pushes() override { return std::exchange(pushes_, {}); }
  void connected(sim::ConnectionId connection) override {
    present_.push_back(connection.value);
    ++came;
  }
  void disconnected(sim::ConnectionId connection) override {
    std::erase(present_, connection.value);
    ++left;
  }

  void reboot(TimePoint /*now*/) override { ++reboots; }

  std::atomic<int> came = 0;
  std::atomic<int> left = 0;
  std::atomic<int> reboots = 0;

 private:
  std::vector<std::uint32_t> present_ = {};
  std::vector<sim::Push> pushes_ = {};
  std::optional<TimePoint> push_at_ = std::nullopt;
  int pushes_per_client_ = 0;
};

// A tool that is served in a thread of its own until the test ends.
class Served {
 public:
  explicit Served(ServeOptions options = {}) {
    std::promise<std::uint16_t> listening;
    options.listening = [&listening](std::uint16_t at) -> Result<void> {
      listening.set_value(at);
      return {};
    };
    auto known = listening.get_future();
    thread_ = std::thread([this, served = options] {
      outcome_ = posix::serve_tcp(tool, served, server_clock_, stop_.get());
    });
    const bool listens = known.wait_for(patience) == std::future_status::ready;
    if (!listens) stop();
    REQUIRE(listens);
    port = known.get();
  }
  ~Served() { stop(); }
  Served(const Served&) = delete;
  Served& operator=(const Served&) = delete;

  Result<void> stop() {
    stop_.raise(2);
    if (thread_.joinable()) thread_.join();
    return outcome_;
  }

  EchoTool tool;
  std::uint16_t port = 0;

 private:
  test::WakingInterrupt stop_;
  posix::SteadyClock server_clock_{stop_.get()};
  Result<void> outcome_ = {};
  std::thread thread_;
};

// A client by way of the transport under test.
class Client {
 public:
  explicit Client(std::uint16_t port, const std::string& host = "127.0.0.1",
                  modbus::Framing framing = modbus::Framing::tcp)
      : framing_(framing) {
    auto opened = posix::open_tcp(host, port, patience, clock_, never_);
    REQUIRE(opened.has_value());
    transport_ = std::move(*opened);
  }
  Result<void> send(const Pdu& pdu, std::uint16_t id = 0x8000) {
    return send_bytes(modbus::frame(framing_, {{id}, {1}, pdu}));
  }
  Result<void> send_bytes(ByteView bytes) {
    return transport_->send(bytes, clock_.now() + patience);
  }
  // The next frame; what ended the connection; nothing at the deadline is a failed test.
  Result<Adu> receive() {
    for (;;) {
      const auto found = modbus::deframe(framing_, modbus::Role::client, buffer_);
      if (const auto* frame = std::get_if<modbus::Deframed>(&found)) {
        const Adu adu = frame->adu;
        buffer_.erase(buffer_.begin(),
                      buffer_.begin() + static_cast<std::ptrdiff_t>(frame->consumed));
        return adu;
      }
      const auto size = fill();
      if (!size) return tl::unexpected(size.error());
      REQUIRE(*size > 0);
    }
  }
  Result<std::size_t> fill() {
    Bytes some(modbus::max_adu_size);
    const auto size = transport_->receive(some, clock_.now() + patience);
    if (size) {
      buffer_.insert(buffer_.end(), some.begin(),
                     some.begin() + static_cast<std::ptrdiff_t>(*size));
    }
    return size;
  }

 private:
  Interrupt never_;
  posix::SteadyClock clock_{never_};
  modbus::Framing framing_;
  std::unique_ptr<link::Transport> transport_;
  Bytes buffer_ = {};
};

Pdu read_one() { return modbus::read_request(RegisterTable::holding, RegisterAddress{7}, 1); }

Bytes framed(const Pdu& pdu) { return modbus::frame(modbus::Framing::tcp, {{0x8000}, {1}, pdu}); }

// The number that the tool knows this client by.
std::uint16_t number_of(Client& client) {
  REQUIRE(client.send(read_one()).has_value());
  const auto answer = client.receive();
  REQUIRE(answer.has_value());
  CHECK(answer->transaction.value == 0x8000);
  return modbus::registers_of(answer->pdu).front();
}

Result<void> serve_and_return(const std::string& host, std::uint16_t port) {
  EchoTool tool;
  test::WakingInterrupt stop;
  posix::SteadyClock clock(stop.get());
  ServeOptions options = {.host = host, .port = port};
  // Should it listen after all, the test fails instead of hanging.
  options.listening = [&stop](std::uint16_t) -> Result<void> {
    stop.raise(2);
    return {};
  };
  return posix::serve_tcp(tool, options, clock, stop.get());
}

}  // namespace

TEST_CASE("serve: several clients get their own answers, in any order") {
  Served served;
  CHECK(served.port != 0);
  Client first(served.port);
  Client second(served.port);
  Client third(served.port);
  CHECK(number_of(second) != number_of(first));
  CHECK(number_of(third) != number_of(first));
  CHECK(number_of(third) != number_of(second));
  CHECK(served.tool.came == 3);
}

TEST_CASE("serve: two hundred clients at once") {
  Served served;
  std::vector<std::unique_ptr<Client>> clients;
  for (int i = 0; i < 200; ++i) clients.push_back(std::make_unique<Client>(served.port));
  for (auto& client : clients) REQUIRE(client->send(read_one()).has_value());
  std::map<std::uint16_t, int> seen;
  for (auto& client : clients) {
    const auto answer = client->receive();
    REQUIRE(answer.has_value());
    ++seen[modbus::registers_of(answer->pdu).front()];
  }
  CHECK(seen.size() == clients.size());
}

TEST_CASE("serve: frames in one piece and byte by byte are answered all the same") {
  Served served;
  Client client(served.port);
  const Bytes request = framed(read_one());
  Bytes three;
  for (int i = 0; i < 3; ++i) three.insert(three.end(), request.begin(), request.end());
  REQUIRE(client.send_bytes(three).has_value());
  for (int i = 0; i < 3; ++i) CHECK(client.receive().has_value());
  for (const std::uint8_t& byte : request) REQUIRE(client.send_bytes({&byte, 1}).has_value());
  CHECK(client.receive().has_value());
}

TEST_CASE("serve: RTU frames over TCP") {
  Served served({.framing = modbus::Framing::rtu});
  Client client(served.port, "127.0.0.1", modbus::Framing::rtu);
  REQUIRE(client.send(read_one()).has_value());
  CHECK(client.receive().has_value());
}

TEST_CASE("serve: what the tool does by itself reaches every client") {
  Served served;
  Client writer(served.port);
  Client listener(served.port);
  number_of(listener);
  REQUIRE(writer.send(modbus::write_request(RegisterAddress{1}, std::uint16_t{1})).has_value());
  const auto echo = writer.receive();
  REQUIRE(echo.has_value());
  CHECK(echo->pdu.function == 0x06);
  for (Client* client : {&writer, &listener}) {
    const auto event = client->receive();
    REQUIRE(event.has_value());
    CHECK(event->transaction.value == 1);
    CHECK(event->pdu.function == 0x04);
  }
}

TEST_CASE("serve: faults of the plan are kept in time") {
  const Interrupt never;
  const posix::SteadyClock clock(never);
  Served served({.faults = {{.kind = sim::FaultKind::latency, .duration = 30ms}}});
  Client client(served.port);
  const TimePoint begun = clock.now();
  number_of(client);
  CHECK(clock.now() - begun >= 30ms);
}

TEST_CASE("serve: a connection that the tool closes is closed, not reset, and the answer arrives") {
  Served served({.faults = {{.kind = sim::FaultKind::close_after}}});
  Client client(served.port);
  // More requests behind the one that is answered: they stay unread by the tool.
  Bytes requests;
  for (int i = 0; i < 2000; ++i) {
    const Bytes request = framed(read_one());
    requests.insert(requests.end(), request.begin(), request.end());
  }
  REQUIRE(client.send_bytes(requests).has_value());
  const auto answer = client.receive();
  REQUIRE(answer.has_value());
  const auto end = client.receive();
  REQUIRE_FALSE(end.has_value());
  CHECK(end.error().code == Errc::closed);
}

TEST_CASE("serve: a client that has said its last word still gets its answer") {
  Served served({.faults = {{.kind = sim::FaultKind::latency, .duration = 10ms}}});
  const Descriptor client = test::connect_plainly(served.port);
  REQUIRE(client.valid());
  const Bytes request = framed(read_one());
  REQUIRE(::send(client.number(), request.data(), request.size(), MSG_NOSIGNAL) ==
          static_cast<ssize_t>(request.size()));
  ::shutdown(client.number(), SHUT_WR);
  Bytes answer(64);
  CHECK(::recv(client.number(), answer.data(), answer.size(), 0) > 0);
  CHECK(::recv(client.number(), answer.data(), answer.size(), 0) == 0);
}

TEST_CASE("serve: a client that takes nothing is given up, and harms no other") {
  std::promise<void> gone;
  std::atomic<bool> told = false;
  ServeOptions options;
  options.log = [&](sim::Heard heard, std::uint32_t, ByteView) {
    if (heard == sim::Heard::disconnected && !told.exchange(true)) gone.set_value();
  };
  Served served(options);
  const Descriptor lazy = test::connect_plainly(served.port);
  REQUIRE(lazy.valid());
  // It only asks: 12 bytes a request, 259 an answer. In the end the connection breaks.
  const Bytes request = framed(
      modbus::read_request(RegisterTable::holding, RegisterAddress{0}, modbus::max_read_count));
  Bytes batch;
  for (int i = 0; i < 300; ++i) batch.insert(batch.end(), request.begin(), request.end());
  for (int sent = 0; sent < 10'000 && !told; ++sent) {
    if (::send(lazy.number(), batch.data(), batch.size(), MSG_NOSIGNAL) < 0) break;
  }
  CHECK(gone.get_future().wait_for(patience) == std::future_status::ready);
  Client other(served.port);
  number_of(other);
}

TEST_CASE("serve: clients that leave, politely or not, are forgotten") {
  Served served;
  Client staying(served.port);
  {
    Client polite(served.port);
    number_of(polite);
    Descriptor rude = test::connect_plainly(served.port);
    const linger abort = {.l_onoff = 1, .l_linger = 0};
    ::setsockopt(rude.number(), SOL_SOCKET, SO_LINGER, &abort, sizeof abort);
  }
  const Interrupt never;
  const posix::SteadyClock clock(never);
  const TimePoint deadline = clock.now() + patience;
  while (served.tool.left < 2 && clock.now() < deadline) number_of(staying);
  CHECK(served.tool.left == 2);
}

TEST_CASE("serve: a sleeping tool answers late, and keeps its connections") {
  Served served({.outages = {{sim::OutageKind::sleep, 100ms, 200ms}}});
  Client client(served.port);
  const auto begun = std::chrono::steady_clock::now();
  auto longest = 0ns;
  while (std::chrono::steady_clock::now() - begun < 500ms) {
    const auto asked = std::chrono::steady_clock::now();
    CHECK(number_of(client) == 1);
    longest = std::max<std::chrono::nanoseconds>(longest, std::chrono::steady_clock::now() - asked);
  }
  CHECK(longest >= 90ms);
  CHECK(served.tool.left == 0);
}

TEST_CASE("serve: who roams or is switched off and on loses its connections") {
  for (const auto kind : {sim::OutageKind::roam, sim::OutageKind::reboot}) {
    Served served({.outages = {{kind, 50ms, 200ms}}});
    Client client(served.port);
    CHECK(number_of(client) == 1);
    const auto end = client.fill();
    REQUIRE_FALSE(end.has_value());
    CHECK(end.error().code == Errc::closed);
    Client next(served.port);
    CHECK(number_of(next) == 2);
    CHECK(served.tool.reboots == (kind == sim::OutageKind::reboot ? 1 : 0));
  }
}

TEST_CASE("serve: while another client holds the session, every other client is shut out") {
  Served served({.outages = {{sim::OutageKind::other_client, 200ms, 400ms}}});
  Client client(served.port);
  CHECK(number_of(client) == 1);
  const auto end = client.fill();
  REQUIRE_FALSE(end.has_value());
  CHECK(end.error().code == Errc::closed);
  Client shut_out(served.port);
  CHECK_FALSE(shut_out.fill().has_value());
  CHECK(served.tool.came == 1);
}

TEST_CASE("serve: an interrupt ends it with success, and every client sees the end") {
  Served served;
  Client first(served.port);
  Client second(served.port);
  number_of(first);
  number_of(second);
  CHECK(served.stop().has_value());
  for (Client* client : {&first, &second}) {
    const auto end = client->receive();
    REQUIRE_FALSE(end.has_value());
    CHECK(end.error().code == Errc::closed);
  }
  CHECK(served.tool.left == 2);
  const Descriptor late = test::connect_plainly(served.port);
  CHECK_FALSE(late.valid());
}

TEST_CASE("serve: the log hears connections and bytes, as the server sees them") {
  std::mutex mutex;
  std::string story;
  Bytes request;
  Bytes response;
  ServeOptions options;
  options.log = [&](sim::Heard heard, std::uint32_t connection, ByteView bytes) {
    const std::lock_guard lock(mutex);
    constexpr const char* words[] = {"connected", "request", "response", "disconnected"};
    story += std::to_string(connection) + " " + words[static_cast<int>(heard)] + "\n";
    if (heard == sim::Heard::request) request.assign(bytes.begin(), bytes.end());
    if (heard == sim::Heard::response) response.assign(bytes.begin(), bytes.end());
  };
  Served served(options);
  Client client(served.port);
  number_of(client);
  CHECK(served.stop().has_value());
  const std::lock_guard lock(mutex);
  CHECK(story == "1 connected\n1 request\n1 response\n1 disconnected\n");
  CHECK(request == framed(read_one()));
  CHECK(response == framed(modbus::read_response(RegisterTable::holding, Registers{1})));
}

TEST_CASE("serve: IPv6") {
  const Result<void> possible = serve_and_return("::1", 0);
  if (!possible) {
    CHECK(possible.error().code == Errc::port_unusable);
    MESSAGE("no IPv6 on this machine");
    return;
  }
  Served served({.host = "::1"});
  Client client(served.port, "::1");
  number_of(client);
}

TEST_CASE("serve: a name of this computer, and a port that is used again at once") {
  std::uint16_t port = 0;
  {
    Served served;
    port = served.port;
    Client client(port);
    number_of(client);
  }
  Served again({.host = "localhost", .port = port});
  CHECK(again.port == port);
}

TEST_CASE("serve: a port that is taken is busy") {
  const test::Acceptor taken;
  const Result<void> result = serve_and_return("127.0.0.1", taken.port());
  REQUIRE_FALSE(result.has_value());
  CHECK(result.error().code == Errc::port_busy);
  CHECK(result.error().message ==
        "127.0.0.1 port " + std::to_string(taken.port()) + " is already in use");
  CHECK(result.error().status() == ExitStatus::unreachable);
}

TEST_CASE("serve: an address of another computer, and a name without address, are unusable") {
  // 192.0.2.0/24 belongs to documentation (RFC 5737): no computer has it.
  const Result<void> foreign = serve_and_return("192.0.2.1", 0);
  REQUIRE_FALSE(foreign.has_value());
  CHECK(foreign.error().code == Errc::port_unusable);
  CHECK(foreign.error().message ==
        "cannot listen on 192.0.2.1 port 0: Cannot assign requested address");
  const Result<void> nameless = serve_and_return("no-such-host.invalid", 0);
  REQUIRE_FALSE(nameless.has_value());
  CHECK(nameless.error().code == Errc::port_unusable);
}

TEST_CASE("serve: what the listening callback refuses ends it") {
  EchoTool tool;
  const Interrupt never;
  posix::SteadyClock clock(never);
  ServeOptions options;
  options.listening = [](std::uint16_t) -> Result<void> {
    return tl::unexpected(Error{.code = Errc::closed_pipe});
  };
  const Result<void> result = posix::serve_tcp(tool, options, clock, never);
  REQUIRE_FALSE(result.has_value());
  CHECK(result.error().code == Errc::closed_pipe);
}
