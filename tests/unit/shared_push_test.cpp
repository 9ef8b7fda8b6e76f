#include <doctest/doctest.h>

#include <array>
#include <atomic>
#include <chrono>
#include <thread>
#include <vector>

#include "spindle/link/asked_line.hpp"
#include "spindle/link/session.hpp"
#include "spindle/link/shared_line.hpp"
#include "spindle/modbus/pdu.hpp"
#include "support/scripted_transport.hpp"

using namespace spindle;
using namespace spindle::link;
using namespace std::chrono_literals;
using modbus::Framing;
using modbus::RegisterTable;
using spindle::test::Arrival;
using spindle::test::FakeClock;

namespace {

constexpr Duration timeout = 1s;
const SpontaneousShape shape = {.function = 0x04, .byte_count = 28};

const modbus::Pdu request = modbus::read_request(RegisterTable::holding, {2}, 1);

modbus::Pdu holding(std::uint16_t value) {
  return modbus::read_response(RegisterTable::holding, Registers{value});
}

modbus::Pdu event(std::uint16_t number) {
  Registers block(14, 0);
  block.front() = number;
  return modbus::read_response(RegisterTable::input, block);
}

Bytes event_frame(std::uint16_t number, std::uint16_t id = 1) {
  return modbus::frame(Framing::tcp, {.transaction = {id}, .unit = {1}, .pdu = event(number)});
}

std::uint16_t number_of(const modbus::Pdu& pdu) { return modbus::registers_of(pdu).front(); }

/// A connection to a tool that sends events, which several sessions have.
struct World : test::ScriptedPeer {
  SharedLine::Open opener() {
    return [this]() -> Result<std::unique_ptr<Transport>> {
      ++opened;
      return test::transport_to(script);
    };
  }
  SessionOptions options(std::vector<SpontaneousShape> shapes = {shape}) const {
    return {.rules = {.framing = Framing::tcp, .spontaneous = std::move(shapes)},
            .unit = {1},
            .answer_timeout = timeout};
  }
  Session session(std::vector<SpontaneousShape> shapes = {shape}) {
    return Session(line.join(opener()).value(), clock, options(std::move(shapes)));
  }
  test::Reaction tcp_answer(Duration after, modbus::Pdu pdu) {
    return test::answer(Framing::tcp, after, std::move(pdu));
  }

  int opened = 0;
  SharedLine line{clock};
};

std::vector<std::uint16_t> taken(Session& session, TimePoint until) {
  std::vector<std::uint16_t> numbers;
  while (true) {
    const auto frame = session.next_spontaneous(until);
    if (!frame || !*frame) return numbers;
    numbers.push_back(number_of((*frame)->pdu));
  }
}

using Numbers = std::vector<std::uint16_t>;

}  // namespace

TEST_CASE("shared connection: what comes outside of the turns reaches every session once") {
  World world;
  Session watcher = world.session();
  Session other = world.session();
  const TimePoint now = world.clock.now();
  Bytes two = event_frame(7);
  const Bytes next = event_frame(8);
  two.insert(two.end(), next.begin(), next.begin() + 20);
  world.script.arrive(now + 1ms, two);
  world.script.arrive(now + 2ms, Bytes(next.begin() + 20, next.end()));
  CHECK(taken(watcher, now + 10ms) == Numbers{7, 8});
  CHECK(taken(other, now + 10ms) == Numbers{7, 8});
  CHECK(taken(watcher, now + 20ms) == Numbers{});
  CHECK(taken(other, now + 20ms) == Numbers{});
}

TEST_CASE("shared connection: an event in the turn of one session reaches the others, in order") {
  World world;
  Session watcher = world.session();
  Session asker = world.session({});  // it does not know what an event looks like
  CHECK(taken(watcher, world.clock.now()) == Numbers{});
  world.script.on_request([&](ByteView bytes) {
    return std::vector<Arrival>{{1ms, event_frame(7)},
                                {2ms, event_frame(8)},
                                {3ms, test::response_to(Framing::tcp, bytes, holding(5))}};
  });
  CHECK(asker.transact(request).value() == holding(5));
  // The next one comes in the watcher's own turn.
  world.script.on_request([&](ByteView bytes) {
    return std::vector<Arrival>{{1ms, event_frame(9)},
                                {3ms, test::response_to(Framing::tcp, bytes, holding(6))}};
  });
  CHECK(watcher.transact(request).value() == holding(6));
  CHECK(taken(watcher, world.clock.now()) == Numbers{7, 8, 9});
  CHECK(world.opened == 1);
}

TEST_CASE("shared connection: half of an event stays with the line") {
  World world;
  Session watcher = world.session();
  Session asker = world.session();
  const TimePoint now = world.clock.now();
  const Bytes whole = event_frame(7);
  world.script.arrive(now + 1ms, Bytes(whole.begin(), whole.begin() + 9));
  CHECK(taken(watcher, now + 5ms) == Numbers{});
  world.script.on_request([&](ByteView bytes) {
    return std::vector<Arrival>{{1ms, Bytes(whole.begin() + 9, whole.end())},
                                {2ms, test::response_to(Framing::tcp, bytes, holding(5))}};
  });
  CHECK(asker.transact(request).value() == holding(5));
  CHECK(taken(watcher, world.clock.now()) == Numbers{7});
  CHECK(taken(asker, world.clock.now()) == Numbers{7});
}

TEST_CASE("shared connection: an event that copies the id of a request is one all the same") {
  World world;
  Session watcher = world.session();
  Session asker = world.session();
  for (const bool pending : {true, false}) {
    world.script.on_request([&](ByteView bytes) {
      const auto id = get_u16(bytes, 0);
      return std::vector<Arrival>{
          {1ms, event_frame(7, pending ? id : static_cast<std::uint16_t>(id - 1))},
          {2ms, test::response_to(Framing::tcp, bytes, holding(5))}};
    });
    CHECK(asker.transact(request).value() == holding(5));
    CHECK(taken(watcher, world.clock.now()) == Numbers{7});
    CHECK(taken(asker, world.clock.now()) == Numbers{7});
  }
}

TEST_CASE("shared connection: a late answer is no event for another session") {
  World world;
  Session watcher = world.session();
  Session asker = world.session({});
  const modbus::Pdu like_an_event = modbus::read_request(RegisterTable::input, {100}, 14);
  Bytes late;
  world.script.on_request([&](ByteView bytes) {
    late = test::response_to(Framing::tcp, bytes, event(9));
    return std::vector<Arrival>{};
  });
  CHECK(asker.transact(like_an_event).error().code == Errc::no_answer);
  SUBCASE("in its own next turn") {
    world.script.on_request([&](ByteView bytes) {
      return std::vector<Arrival>{{1ms, late},
                                  {2ms, test::response_to(Framing::tcp, bytes, holding(5))}};
    });
    CHECK(asker.transact(request).value() == holding(5));
  }
  SUBCASE("in the turn of the watcher") {
    world.script.on_request([&](ByteView bytes) {
      return std::vector<Arrival>{{1ms, late},
                                  {2ms, test::response_to(Framing::tcp, bytes, holding(5))}};
    });
    CHECK(watcher.transact(request).value() == holding(5));
  }
  CHECK(taken(watcher, world.clock.now()) == Numbers{});
}

TEST_CASE(
    "shared connection: a stream without frames ends it for all, and for the one that listened") {
  World world;
  Session watcher = world.session();
  Session asker = world.session();
  world.script.arrive(world.clock.now() + 1ms, Bytes(12, 0xFF));
  CHECK(watcher.next_spontaneous(world.clock.now() + 5ms).error().code == Errc::malformed_answer);
  CHECK(asker.transact(request).error().code == Errc::malformed_answer);
  Session anew = world.session();
  world.script.on_request(world.tcp_answer(1ms, holding(5)));
  CHECK(anew.transact(request).value() == holding(5));
  CHECK(world.opened == 2);
}

TEST_CASE(
    "shared connection: another program's share keeps nothing open, and is told what ended it") {
  World world;
  auto owner = std::make_unique<Session>(world.line.join(world.opener()).value(), world.clock,
                                         world.options());
  Session asker(world.line.join_open().value(), world.clock, world.options());
  world.script.on_request(world.tcp_answer(1ms, holding(5)));
  CHECK(asker.transact(request).value() == holding(5));
  owner.reset();
  CHECK(world.line.trouble());
  CHECK_FALSE(world.line.join_open());
  CHECK(asker.transact(request).error().code == Errc::closed);
  CHECK(world.script.sent.size() == 1);
  const Session again = world.session();
  CHECK_FALSE(world.line.trouble());
  CHECK(world.line.opening() == 2);
}

TEST_CASE("shared connection: an ear hears every event, in whatever turn it comes") {
  World world;
  Session watcher = world.session();
  Session asker(world.line.join_open().value(), world.clock, world.options());
  Numbers heard;
  auto ear = world.line.listen(
      [&](ByteView frame) { heard.push_back(number_of(one_frame(frame).value().pdu)); });
  world.script.on_request([&](ByteView bytes) {
    return std::vector<Arrival>{{1ms, event_frame(7)},
                                {2ms, test::response_to(Framing::tcp, bytes, holding(5))}};
  });
  CHECK(asker.transact(request).value() == holding(5));
  world.script.on_request([&](ByteView bytes) {
    return std::vector<Arrival>{{1ms, event_frame(8)},
                                {2ms, test::response_to(Framing::tcp, bytes, holding(5))}};
  });
  CHECK(watcher.transact(request).value() == holding(5));
  world.script.arrive(world.clock.now() + 1ms, event_frame(9));
  CHECK(taken(watcher, world.clock.now() + 2ms) == Numbers{7, 8, 9});
  CHECK(heard == Numbers{7, 8, 9});
  ear.reset();
  world.script.arrive(world.clock.now() + 1ms, event_frame(10));
  CHECK(taken(watcher, world.clock.now() + 2ms) == Numbers{10});
  CHECK(heard == Numbers{7, 8, 9});
}

TEST_CASE("shared line: what is known of one unit goes from session to session") {
  test::ScriptedPeer world;
  SharedLine line{world.clock};
  const auto open = [&]() -> Result<std::unique_ptr<Transport>> {
    return test::transport_to(world.script);
  };
  const SessionOptions options = {.rules = {.framing = Framing::rtu, .spontaneous = {}},
                                  .unit = {1},
                                  .answer_timeout = timeout,
                                  .gap = 5ms,
                                  .echo = LocalEcho::absent};
  Session owner(line.join(open).value(), world.clock, options);
  Session asker(line.join_open().value(), world.clock, options);
  world.script.on_request(test::answer(Framing::rtu, 10ms, holding(1)));
  CHECK(owner.transact(request).value() == holding(1));
  world.script.on_request(test::answer(Framing::rtu, timeout + 200ms, holding(2)));
  CHECK(asker.transact(request).error().code == Errc::no_answer);
  const TimePoint gave_up = world.clock.now();
  // The late answer would look like that of the same unit to the owner.
  world.script.on_request(test::answer(Framing::rtu, 300ms, holding(3)));
  CHECK(owner.transact(request).value() == holding(3));
  CHECK(world.script.sent[2].at >= gave_up + timeout);
  CHECK(owner.counters().strays == 1);
}

TEST_CASE("fair lock: a stop goes first") {
  FairLock lock;
  std::vector<int> order;
  lock.lock();
  std::atomic<int> waiting = 0;
  const auto called = [&] { ++waiting; };
  const auto wait_for = [&](int count) {
    while (waiting < count) std::this_thread::yield();
  };
  {
    std::vector<std::jthread> threads;
    for (const int number : {1, 2}) {
      threads.emplace_back([&, number] {
        lock.lock(Lane::usual, called);
        order.push_back(number);
        lock.unlock();
      });
      wait_for(number);
    }
    threads.emplace_back([&] {
      lock.lock(Lane::stop, called);
      order.push_back(0);
      lock.unlock();
    });
    wait_for(3);
    CHECK(lock.is_wanted(Lane::stop));
    lock.unlock();
  }
  CHECK(order == std::vector<int>{0, 1, 2});
  CHECK_FALSE(lock.is_wanted());
  CHECK(lock.try_lock());
  CHECK_FALSE(lock.try_lock());
}
