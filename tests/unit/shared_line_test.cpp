#include "spindle/link/shared_line.hpp"

#include <doctest/doctest.h>

#include <array>
#include <atomic>
#include <chrono>
#include <csignal>
#include <optional>
#include <thread>

#include "spindle/link/session.hpp"
#include "spindle/modbus/pdu.hpp"
#include "support/scripted_transport.hpp"

using namespace spindle;
using namespace spindle::link;
using namespace std::chrono_literals;
using modbus::Framing;
using modbus::RegisterTable;
using spindle::test::answer;
using spindle::test::Arrival;
using spindle::test::FakeClock;
using spindle::test::Script;

namespace {

constexpr Duration gap = 5500us;  // BLV manual: silence up to 19200 baud
constexpr Duration timeout = 1s;

const modbus::Pdu request = modbus::read_request(RegisterTable::holding, {2}, 1);
const modbus::Pdu value = modbus::read_response(RegisterTable::holding, Registers{271});

/// A line, its peer, and how often it was opened and is open.
struct World : test::ScriptedPeer {
  SharedLine::Open opener() {
    return [this]() -> Result<std::unique_ptr<Transport>> {
      if (refusal) return tl::unexpected(Error{.code = *refusal});
      ++opened;
      return std::make_unique<Counted>(*this);
    };
  }
  std::unique_ptr<Transport> join() { return line.join(opener()).value(); }
  Session session(std::uint8_t unit) {
    return Session(join(), clock,
                   {.rules = {.framing = Framing::rtu, .spontaneous = {}},
                    .unit = {unit},
                    .answer_timeout = timeout,
                    .gap = gap,
                    .echo = LocalEcho::absent});
  }

  struct Counted : Transport {
    explicit Counted(World& of) : world(&of), peer(test::transport_to(of.script)) { ++of.open; }
    ~Counted() override { --world->open; }
    Result<void> send(ByteView bytes, TimePoint deadline) override {
      return peer->send(bytes, deadline);
    }
    Result<std::size_t> receive(std::span<std::uint8_t> into, TimePoint deadline) override {
      return peer->receive(into, deadline);
    }
    void set_uninterruptible() override { peer->set_uninterruptible(); }
    World* world;
    std::unique_ptr<Transport> peer;
  };

  std::optional<Errc> refusal = std::nullopt;
  int opened = 0;
  int open = 0;
  SharedLine line{clock};
};

}  // namespace

TEST_CASE("shared line: the first opens it, the last closes it, the next opens it anew") {
  World world;
  world.refusal = Errc::port_busy;
  CHECK(world.line.join(world.opener()).error().code == Errc::port_busy);
  world.refusal.reset();
  auto first = world.join();
  auto second = world.join();
  CHECK(world.opened == 1);
  first.reset();
  CHECK(world.open == 1);
  second.reset();
  CHECK(world.open == 0);
  const auto third = world.join();
  CHECK(world.opened == 2);
  CHECK(world.open == 1);
}

TEST_CASE("shared line: a session keeps the silence behind what another one has sent or heard") {
  World world;
  Session one = world.session(1);
  Session two = world.session(2);
  for (Session* session : {&one, &two, &one, &two, &two, &one}) {
    world.script.on_request(answer(Framing::rtu, 10ms, value));
    CHECK(session->transact(request).value() == value);
  }
  REQUIRE(world.script.sent.size() == 6);
  for (std::size_t i = 1; i < world.script.sent.size(); ++i) {
    CAPTURE(i);
    const Duration apart = world.script.sent[i].at - world.script.sent[i - 1].at;
    CHECK(apart == 10ms + gap);
    CHECK(world.script.sent[i].bytes[0] == (i == 1 || i == 3 || i == 4 ? 2 : 1));
  }
}

TEST_CASE(
    "shared line: the late answer of one unit is nothing to another, and does not hold it up") {
  World world;
  Session one = world.session(1);
  Session two = world.session(2);
  world.script.on_request(answer(Framing::rtu, timeout + 100ms, value));
  CHECK(one.transact(request).error().code == Errc::no_answer);
  const TimePoint gave_up = world.clock.now();
  const modbus::Pdu other = modbus::read_response(RegisterTable::holding, Registers{7});
  world.script.on_request(answer(Framing::rtu, 300ms, other));
  CHECK(two.transact(request).value() == other);
  CHECK(world.script.sent[1].at == gave_up);  // the line has long been silent
  CHECK(two.counters().strays == 1);
  // The unit that did not answer is asked again only when no late answer can come.
  world.script.on_request(answer(Framing::rtu, 10ms, value));
  CHECK(one.transact(request).value() == value);
  CHECK(world.script.sent[2].at >= gave_up + timeout);
}

TEST_CASE("shared line: outside of a turn nothing is received, and a wait can be interrupted") {
  World world;
  const auto idle = world.join();
  auto second = world.join();
  world.script.arrive(world.clock.now() + 1ms, Bytes{1, 2, 3});
  std::array<std::uint8_t, 8> bytes{};
  const TimePoint deadline = world.clock.now() + 1s;
  CHECK(idle->receive(bytes, deadline).value() == 0);
  CHECK(world.clock.now() == deadline);
  idle->acquire_bus();
  CHECK(idle->receive(bytes, deadline).value() == 3);
  idle->release_bus({.used_until = deadline});
  world.interrupt.raise(SIGINT);
  CHECK(idle->receive(bytes, deadline + 1s).error().code == Errc::interrupted);
}

TEST_CASE("shared line: the only share hears all that comes, as if the line was its own") {
  World world;
  const auto only = world.join();
  world.script.arrive(world.clock.now() + 1ms, Bytes{1, 2, 3});
  std::array<std::uint8_t, 8> bytes{};
  CHECK(only->receive(bytes, world.clock.now() + 1s).value() == 3);
  CHECK(world.clock.now() == FakeClock::start + 1ms);
}

TEST_CASE("shared line: when it breaks it does so for all, and the next opens it anew") {
  World world;
  Session one = world.session(1);
  Session two = world.session(2);
  world.script.on_request([](ByteView) { return std::vector<Arrival>{{10ms, Errc::reset}}; });
  CHECK(one.transact(request).error().code == Errc::reset);
  CHECK(world.open == 0);
  world.script.pending.clear();
  CHECK(two.transact(request).error().code == Errc::reset);
  Session three = world.session(3);
  CHECK(world.opened == 2);
  CHECK(two.transact(request).error().code == Errc::reset);  // of the first opening
  world.script.on_request(answer(Framing::rtu, 10ms, value));
  CHECK(three.transact(request).value() == value);
}

TEST_CASE("shared line: the end of an old share does not close a new opening") {
  World world;
  auto old = world.join();
  old->acquire_bus();
  world.script.arrive(world.clock.now(), Bytes());
  world.script.pending.clear();
  world.script.pending.emplace(world.clock.now(), Errc::closed);
  std::array<std::uint8_t, 8> bytes{};
  CHECK_FALSE(old->receive(bytes, world.clock.now()));
  old->release_bus({});
  world.script.pending.clear();
  const auto fresh = world.join();
  old.reset();
  CHECK(world.open == 1);
}

TEST_CASE("shared line: one at a time, and each of them in the end") {
  FairLock lock;
  std::atomic<int> inside = 0;
  std::atomic<bool> overlapped = false;
  std::array<int, 2> turns{};
  const auto work = [&](int& mine) {
    for (int i = 0; i < 200; ++i) {
      const std::lock_guard guard(lock);
      if (++inside != 1) overlapped = true;
      ++mine;
      std::this_thread::yield();
      --inside;
    }
  };
  {
    const std::jthread other([&] { work(turns[1]); });
    work(turns[0]);
  }
  CHECK_FALSE(overlapped);
  CHECK(turns == std::array<int, 2>{200, 200});
}

// ---- a gateway ----

namespace {

/// A connection to a gateway, whose units are sessions.
struct Gateway : World {
  explicit Gateway(Stays stays = Stays::while_answering,
                   modbus::TransactionIds ids = modbus::TransactionIds::echoed)
      : transactions(ids), connection(clock, stays) {}

  [[nodiscard]] SessionOptions options(std::uint8_t number, Duration patience = timeout) const {
    return {.rules = {.framing = Framing::tcp, .transactions = transactions},
            .unit = {number},
            .answer_timeout = patience};
  }
  Session unit(std::uint8_t number, Duration patience = timeout) {
    return Session(connection.join(opener()).value(), clock, options(number, patience));
  }
  [[nodiscard]] std::uint16_t id_of(std::size_t at) const {
    return get_u16(script.sent.at(at).bytes, 0);
  }

  modbus::TransactionIds transactions;
  SharedLine connection;
};

modbus::Pdu holding(std::uint16_t word) {
  return modbus::read_response(RegisterTable::holding, Registers{word});
}

test::Reaction tcp_answer(Duration after, modbus::Pdu pdu) {
  return answer(Framing::tcp, after, std::move(pdu));
}

Bytes half_of(ByteView bytes) {
  return {bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(bytes.size() / 2)};
}

Bytes rest_of(ByteView bytes) {
  return {bytes.begin() + static_cast<std::ptrdiff_t>(bytes.size() / 2), bytes.end()};
}

}  // namespace

TEST_CASE("gateway: its units share one connection, and no two requests have the same id") {
  Gateway world;
  Session one = world.unit(1);
  Session two = world.unit(2);
  for (Session* session : {&one, &two, &two, &one, &two}) {
    world.script.on_request(tcp_answer(5ms, value));
    CHECK(session->transact(request).value() == value);
  }
  CHECK(world.opened == 1);
  for (std::size_t at = 1; at < 5; ++at) CHECK(world.id_of(at) == world.id_of(at - 1) + 1);
  CHECK(world.script.sent[1].bytes[6] == 2);
  CHECK(world.script.sent[3].bytes[6] == 1);
}

TEST_CASE("gateway: the late answer of one unit is never that of another, with ids or without") {
  using modbus::TransactionIds;
  for (const TransactionIds ids : {TransactionIds::echoed, TransactionIds::ignored}) {
    for (const Duration late : {1001ms, 1003ms, 1100ms, 1500ms, 4000ms}) {
      CAPTURE(static_cast<int>(ids));
      CAPTURE(late.count());
      Gateway world(Stays::while_answering, ids);
      Session one = world.unit(1);
      Session two = world.unit(2, 300ms);
      world.script.on_request(tcp_answer(late, value));
      CHECK(one.transact(request).error().code == Errc::no_answer);
      const TimePoint gave_up = world.clock.now();
      for (int count = 0; count < 600; ++count) {
        world.script.on_request(tcp_answer(5ms, holding(7)));
        CHECK(two.transact(request).value() == holding(7));
      }
      CHECK(world.script.sent[1].at == gave_up);  // the others are not held up
      CHECK(two.counters().strays == 1);
      CHECK(world.open == 1);
    }
  }
}

TEST_CASE("gateway: a unit with a timeout of its own gives up after that") {
  Gateway world;
  Session slow = world.unit(1, 3s);
  Session quick = world.unit(2, 200ms);
  const TimePoint began = world.clock.now();
  CHECK(quick.transact(request).error().code == Errc::no_answer);
  CHECK(world.clock.now() - began == 200ms);
  world.script.on_request(tcp_answer(2500ms, value));
  CHECK(slow.transact(request).value() == value);
}

TEST_CASE("gateway: what a unit does not answer to is told to it alone (0A, 0B)") {
  using modbus::TransactionIds;
  for (const TransactionIds ids : {TransactionIds::echoed, TransactionIds::ignored}) {
    for (const std::uint8_t code : std::initializer_list<std::uint8_t>{0x0A, 0x0B}) {
      Gateway world(Stays::while_answering, ids);
      const modbus::Pdu exception = modbus::exception_response(0x03, code);
      Session two = world.unit(2);
      for (int count = 0; count < 5; ++count) {
        Session one = world.unit(1);  // a watch begins anew behind such trouble
        world.script.on_request(tcp_answer(5ms, exception));
        CHECK(one.transact(request).value() == exception);
        world.script.on_request(tcp_answer(5ms, value));
        CHECK(two.transact(request).value() == value);
      }
      CHECK(world.opened == 1);
      CHECK(world.script.sent.size() == 10);
    }
  }
}

TEST_CASE("gateway: the connection stays open behind an answer, and not where nothing came") {
  Gateway world;
  {
    Session one = world.unit(1);
    world.script.on_request(tcp_answer(5ms, modbus::exception_response(0x03, 0x0B)));
    CHECK(one.transact(request));
  }
  CHECK(world.open == 1);
  {
    Session one = world.unit(1);
    CHECK_FALSE(one.transact(request));
  }
  CHECK(world.open == 0);
  CHECK(world.opened == 1);

  Gateway lasting(Stays::while_it_lives);
  { CHECK_FALSE(lasting.unit(1).transact(request)); }
  CHECK(lasting.open == 1);
}

TEST_CASE("gateway: what stayed open is closed when no unit has it any more") {
  Gateway world;
  {
    const auto one = world.connection.join(world.opener());
    Session two = world.unit(2);
    world.script.on_request(tcp_answer(5ms, value));
    CHECK(two.transact(request));
    world.connection.close_unused({.code = Errc::closed});
    CHECK(world.open == 1);
  }
  CHECK(world.open == 1);
  world.connection.close_unused({.code = Errc::closed});
  CHECK(world.open == 0);
}

TEST_CASE("gateway: half a frame in one turn is a whole one in the next") {
  Gateway world;
  Session one = world.unit(1);
  Session two = world.unit(2);
  Bytes late;
  world.script.on_request([&](ByteView bytes) {
    late = test::response_to(Framing::tcp, bytes, value);
    return std::vector<Arrival>{{900ms, half_of(late)}};
  });
  CHECK(one.transact(request).error().code == Errc::incomplete_answer);
  SUBCASE("the rest comes before the next request") {
    world.script.arrive(world.clock.now(), rest_of(late));
    world.script.on_request(tcp_answer(5ms, holding(7)));
  }
  SUBCASE("the rest comes in front of the next answer") {
    world.script.on_request([&](ByteView bytes) {
      return std::vector<Arrival>{{3ms, rest_of(late)},
                                  {5ms, test::response_to(Framing::tcp, bytes, holding(7))}};
    });
  }
  SUBCASE("the rest never comes") { world.script.on_request(tcp_answer(5ms, holding(7))); }
  CHECK(two.transact(request).value() == holding(7));
  world.script.on_request(tcp_answer(5ms, holding(8)));
  CHECK(one.transact(request).value() == holding(8));
  CHECK(world.opened == 1);
}

TEST_CASE("gateway: a lost connection is told to each unit and made again once") {
  Gateway world;
  Session one = world.unit(1);
  Session two = world.unit(2);
  Session three = world.unit(3);
  world.script.on_request([](ByteView) { return std::vector<Arrival>{{10ms, Errc::closed}}; });
  CHECK(two.transact(request).error().code == Errc::closed);
  world.script.pending.clear();
  CHECK(world.open == 0);
  std::vector<std::unique_ptr<Session>> again;
  for (const std::uint8_t number : std::initializer_list<std::uint8_t>{2, 1, 3}) {
    if (number == 1) CHECK(one.transact(request).error().code == Errc::closed);
    if (number == 3) CHECK(three.transact(request).error().code == Errc::closed);
    again.push_back(std::make_unique<Session>(world.connection.join(world.opener()).value(),
                                              world.clock, world.options(number)));
    world.script.on_request(tcp_answer(5ms, value));
    CHECK(again.back()->transact(request).value() == value);
  }
  CHECK(world.opened == 2);
  CHECK(world.script.sent.size() == 4);  // nothing was sent for those who had lost it
}

TEST_CASE(
    "gateway: a stream without frames is given up for all, and what is left of it forgotten") {
  Gateway world;
  Session one = world.unit(1);
  Session two = world.unit(2);
  world.script.on_request(test::say(5ms, Bytes(12, 0xFF)));
  CHECK(one.transact(request).error().code == Errc::malformed_answer);
  CHECK(world.open == 0);
  CHECK(two.transact(request).error().code == Errc::malformed_answer);
  Session anew = world.unit(2);
  world.script.on_request(tcp_answer(5ms, value));
  CHECK(anew.transact(request).value() == value);
  CHECK(one.transact(request).error().code == Errc::malformed_answer);  // of the old one
  world.script.on_request(tcp_answer(5ms, holding(7)));
  CHECK(anew.transact(request).value() == holding(7));
  CHECK(world.opened == 2);
}

TEST_CASE("gateway: without ids a unit that was given up is proved when it is connected again") {
  Gateway world(Stays::while_answering, modbus::TransactionIds::ignored);
  const modbus::Pdu elsewhere = modbus::read_request(RegisterTable::holding, {9}, 1);
  const auto response = [&](ByteView bytes) {
    const modbus::Adu asked = test::request_of(Framing::tcp, bytes);
    return test::response_to(Framing::tcp, bytes, asked.pdu == elsewhere ? holding(7) : value);
  };
  Session other = world.unit(2);
  for (Duration held_up = 3100ms; held_up < 9s; held_up += 83ms) {
    CAPTURE(held_up.count());
    world.clock.advance(60s);
    world.script.otherwise = {};
    world.script.pending.clear();
    world.script.on_request([&](ByteView bytes) {
      return std::vector<Arrival>{{5ms, response(bytes)}};
    });
    CHECK(other.transact(request).value() == value);
    test::Queue queue(world.clock, world.clock.now() + held_up, response);
    world.script.otherwise = [&](ByteView bytes) { return queue.answer(bytes); };
    for (int count = 0; count < 3; ++count) {
      Session one = world.unit(1);
      static_cast<void>(one.transact(request));
    }
    Session one = world.unit(1);
    for (int count = 0; count < 40; ++count) {
      const auto read = one.transact(elsewhere);
      if (read) CHECK(*read == holding(7));
    }
  }
  CHECK(world.opened == 1);
}
