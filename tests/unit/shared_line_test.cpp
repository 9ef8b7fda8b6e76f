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
