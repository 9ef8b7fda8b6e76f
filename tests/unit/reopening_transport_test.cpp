#include "spindle/link/reopening_transport.hpp"

#include <doctest/doctest.h>

#include <deque>
#include <memory>
#include <string>
#include <vector>

#include "spindle/link/client.hpp"
#include "spindle/link/session.hpp"
#include "support/scripted_transport.hpp"

using namespace spindle;
using namespace std::chrono_literals;
using link::ReopeningTransport;
using link::Session;
using test::Arrival;
using test::Script;

namespace {

constexpr auto tcp = modbus::Framing::tcp;

/// A server of which each connection has a script of its own.
struct Server {
  Script& connection() { return *scripts.emplace_back(std::make_unique<Script>(clock)); }

  Result<std::unique_ptr<link::Transport>> open() {
    if (opened == scripts.size()) return tl::unexpected(Error{.code = Errc::connection_refused});
    return test::transport_to(*scripts[opened++]);
  }
  Session& session() {
    if (!made) {
      made = std::make_unique<Session>(
          std::make_unique<ReopeningTransport>(
              open().value(), [this] { return open(); }, clock, link::Trace{}),
          clock, link::SessionOptions{.rules = {.framing = tcp, .spontaneous = {}}});
    }
    return *made;
  }

  test::FakeClock clock = {};
  std::vector<std::unique_ptr<Script>> scripts = {};
  std::size_t opened = 0;
  std::unique_ptr<Session> made = nullptr;
};

modbus::Pdu read(std::uint16_t address) {
  return modbus::read_request(modbus::RegisterTable::holding, {address}, 1);
}

modbus::Pdu value(std::uint16_t word) {
  return modbus::read_response(modbus::RegisterTable::holding, Registers{word});
}

/// An answer, and the end of the connection right behind it.
test::Reaction last_answer(modbus::Pdu pdu, Duration end = 0ms) {
  return [=](ByteView request) {
    return std::vector<Arrival>{{1ms, test::response_to(tcp, request, pdu)},
                                {1ms + end, Errc::closed}};
  };
}

test::Reaction disconnect(Errc how = Errc::closed) {
  return [how](ByteView) { return std::vector<Arrival>{{1ms, how}}; };
}

std::uint16_t word_of(const Result<modbus::Pdu>& answer) {
  REQUIRE(answer);
  return modbus::registers_of(*answer).front();
}

}  // namespace

TEST_CASE("reads and writes go on over a server that hangs up behind every answer") {
  Server server;
  server.connection().on_request(last_answer(value(7)));
  server.connection().on_request(last_answer(value(8)));
  server.connection().on_request(last_answer(modbus::write_request({3}, 9)));
  server.connection().on_request(last_answer(value(9)));
  CHECK(word_of(server.session().transact(read(1))) == 7);
  server.clock.advance(1ms);
  CHECK(word_of(server.session().transact(read(2))) == 8);
  server.clock.advance(1ms);
  CHECK(server.session().transact(modbus::write_request({3}, 9)));
  CHECK(word_of(server.session().transact(read(3))) == 9);
  CHECK(server.opened == 4);
  for (const auto& script : server.scripts) CHECK(script->sent.size() == 1);
}

TEST_CASE("what was answered is not asked again when the connection ends behind it") {
  Server server;
  server.connection().on_request(last_answer(value(7)));
  server.connection().on_request(test::answer(tcp, 1ms, value(8)));
  CHECK(word_of(server.session().transact(read(1))) == 7);
  const auto nothing = server.session().next_spontaneous(server.clock.now() + 1s);
  REQUIRE_FALSE(nothing);
  CHECK(nothing.error().code == Errc::closed);
  CHECK(server.opened == 1);
  CHECK(word_of(server.session().transact(read(2))) == 8);
}

TEST_CASE("a read whose answer does not come whole is sent once more") {
  Server server;
  SUBCASE("nothing came") { server.connection().on_request(disconnect()); }
  SUBCASE("the connection was reset") { server.connection().on_request(disconnect(Errc::reset)); }
  SUBCASE("half of it came") {
    server.connection().on_request([](ByteView request) {
      Bytes half = test::response_to(tcp, request, value(6));
      half.resize(half.size() - 1);
      return std::vector<Arrival>{{1ms, half}, {2ms, Errc::closed}};
    });
  }
  server.connection().on_request(test::answer(tcp, 1ms, value(7)));
  CHECK(word_of(server.session().transact(read(1))) == 7);
  CHECK(server.scripts[0]->sent.size() == 1);
  CHECK(server.scripts[1]->sent.size() == 1);
}

TEST_CASE("a write that was sent is never sent again") {
  Server server;
  server.connection().on_request(disconnect());
  server.connection().on_request(test::answer(tcp, 1ms, value(7)));
  const auto written = server.session().transact(modbus::write_request({3}, 9));
  REQUIRE_FALSE(written);
  CHECK(written.error().code == Errc::closed);
  CHECK(server.opened == 1);
  // What became of it can be read.
  CHECK(word_of(server.session().transact(read(3))) == 7);
  CHECK(server.opened == 2);
}

TEST_CASE("a write gets a new connection where the end of this one may be on the way") {
  Server server;
  server.connection().on_request(last_answer(value(7)));
  server.connection().on_request(last_answer(value(8), 50ms));  // not seen before the write
  server.connection().on_request(last_answer(modbus::write_request({3}, 9)));
  CHECK(word_of(server.session().transact(read(1))) == 7);
  server.clock.advance(1ms);
  CHECK(word_of(server.session().transact(read(2))) == 8);
  CHECK(server.session().transact(modbus::write_request({3}, 9)));
  CHECK(server.opened == 3);
}

TEST_CASE("a server that brings nothing twice is given up, with the first error") {
  Server server;
  server.connection().on_request(disconnect());
  SUBCASE("it hangs up again") {
    server.connection().on_request(disconnect());
    server.connection();
  }
  SUBCASE("it takes no connection any more") {}
  const auto answer = server.session().transact(read(1));
  REQUIRE_FALSE(answer);
  CHECK(answer.error().code == Errc::closed);
  CHECK(server.opened <= 2);
}

TEST_CASE("a part of an answer is handed over when its time is over") {
  Server server;
  server.connection().on_request([](ByteView request) {
    Bytes half = test::response_to(tcp, request, value(6));
    half.resize(half.size() - 1);
    return std::vector<Arrival>{{1ms, half}};
  });
  const auto answer = server.session().transact(read(1));
  REQUIRE_FALSE(answer);
  CHECK(answer.error().code == Errc::incomplete_answer);
}
