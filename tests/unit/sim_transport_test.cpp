#include "spindle/sim/sim_transport.hpp"

#include <doctest/doctest.h>

#include <array>
#include <string>
#include <vector>

#include "hex.hpp"
#include "support/rig.hpp"

using namespace spindle;
using namespace spindle::sim;
using namespace std::chrono_literals;
using modbus::Framing;
using spindle::test::FakeClock;
using spindle::test::hex;

namespace {

const Bytes read_two = hex("8002 0000 0006 00 03 0002 0002");
const Bytes two = hex("8002 0000 0007 00 03 04 010F 03E8");
const Bytes arm = hex("8004 0000 0006 00 06 0FA2 0001");
const Bytes start = hex("8005 0000 0006 00 06 0FA3 0001");
const Bytes reset_alarm = hex("8006 0000 0006 00 06 0FA0 0001");

struct Bench : test::BmRig {
  explicit Bench(const std::vector<std::string>& typed = {}) {
    transport =
        make_sim_transport(std::move(tool), Framing::tcp, test::plan_of(typed), clock, interrupt);
  }

  Result<void> send(const Bytes& bytes) { return transport->send(bytes, clock.now() + 1s); }

  Result<Bytes> receive(Duration timeout, std::size_t room = 260) {
    Bytes into(room);
    const auto count = transport->receive(into, clock.now() + timeout);
    if (!count) return tl::unexpected(count.error());
    into.resize(*count);
    return into;
  }

  [[nodiscard]] Duration elapsed() const { return clock.now() - FakeClock::start; }

  std::unique_ptr<link::Transport> transport = nullptr;
};

}  // namespace

TEST_CASE("an answer takes a tenth of a millisecond, unless a fault says more") {
  Bench quick;
  REQUIRE(quick.send(read_two).has_value());
  CHECK(quick.receive(1s) == two);
  CHECK(quick.elapsed() == 100us);

  Bench slow({"latency=30ms"});
  REQUIRE(slow.send(read_two).has_value());
  CHECK(slow.receive(1s) == two);
  CHECK(slow.elapsed() == 30ms);
}

TEST_CASE("nothing comes: empty at the deadline, not before") {
  Bench bench({"lost"});
  REQUIRE(bench.send(read_two).has_value());
  CHECK(bench.receive(1s) == Bytes{});
  CHECK(bench.elapsed() == 1s);
}

TEST_CASE("what is there is given even when the deadline has passed") {
  Bench bench;
  REQUIRE(bench.send(read_two).has_value());
  bench.clock.advance(1ms);
  CHECK(bench.receive(-1ms) == two);
  CHECK(bench.elapsed() == 1ms);
}

TEST_CASE("a small buffer gets the rest later") {
  Bench bench;
  REQUIRE(bench.send(read_two).has_value());
  CHECK(bench.receive(1s, 9) == hex("8002 0000 0007 00 03 04"));
  CHECK(bench.receive(0s, 9) == hex("010F 03E8"));
}

TEST_CASE("pieces arrive one by one") {
  Bench bench({"split=8"});
  REQUIRE(bench.send(read_two).has_value());
  CHECK(bench.receive(1s) == hex("8002 0000 0007 00 03"));
  CHECK(bench.receive(1s) == hex("04 010F 03E8"));
  CHECK(bench.elapsed() == 1100us);
}

TEST_CASE("a closed connection says so, for ever") {
  Bench bench({"close-inside@2"});
  REQUIRE(bench.send(read_two).has_value());
  CHECK(bench.receive(1s) == two);
  REQUIRE(bench.send(read_two).has_value());
  CHECK(bench.receive(1s) == hex("8002 0000 0007"));
  for (int i = 0; i < 2; ++i) {
    const auto end = bench.receive(1s);
    REQUIRE_FALSE(end.has_value());
    CHECK(end.error().code == Errc::closed);
    const auto sent = bench.send(read_two);
    REQUIRE_FALSE(sent.has_value());
    CHECK(sent.error().code == Errc::closed);
  }
  CHECK(bench.elapsed() == 200us);
}

TEST_CASE("the tool lives while the client waits: the echo, then the event when it happens") {
  Bench bench;
  REQUIRE(bench.send(arm).has_value());
  CHECK(bench.receive(1s) == arm);
  REQUIRE(bench.send(start).has_value());
  CHECK(bench.receive(5s) == start);
  const auto event = bench.receive(5s);
  REQUIRE(event.has_value());
  REQUIRE(event->size() == 37);
  CHECK(ByteView(*event).first(9)[8] == 28);
  CHECK(get_u16(*event, 0) == 1);
  CHECK(get_u16(*event, 9) == 1962);
  CHECK(bench.elapsed() == 1200ms + 200us);
  CHECK(bench.receive(3s) == Bytes{});
}

TEST_CASE("an event that a write causes follows the write's echo") {
  Bench bench;
  REQUIRE(bench.send(arm).has_value());
  CHECK(bench.receive(1s) == arm);
  REQUIRE(bench.send(reset_alarm).has_value());
  CHECK(bench.receive(1s) == reset_alarm);
  CHECK(bench.receive(0s)->size() == 37);
}

TEST_CASE("an interrupt ends a wait at once") {
  Bench bench({"lost"});
  bench.clock.at(FakeClock::start + 300ms, [&] { bench.interrupt.raise(2); });
  REQUIRE(bench.send(read_two).has_value());
  const auto got = bench.receive(1s);
  REQUIRE_FALSE(got.has_value());
  CHECK(got.error().code == Errc::interrupted);
  CHECK(bench.elapsed() == 300ms);
  const auto sent = bench.send(read_two);
  REQUIRE_FALSE(sent.has_value());
  CHECK(sent.error().code == Errc::interrupted);
}

TEST_CASE("behind the shield the last words get their answers though no wait is possible") {
  Bench bench({"lost@2"});
  bench.interrupt.raise(15);
  bench.transport->set_uninterruptible();
  REQUIRE(bench.send(read_two).has_value());
  CHECK(bench.receive(1s) == two);
  REQUIRE(bench.send(read_two).has_value());
  CHECK(bench.receive(1s) == Bytes{});
  REQUIRE(bench.send(read_two).has_value());
  CHECK(bench.receive(1s) == two);
  CHECK(bench.elapsed() == 0s);
}

TEST_CASE("two transports share one tool and one count of answers") {
  test::BmRig rig;
  rig.faults = test::plan_of({"lost@2"});
  auto& clock = rig.clock;
  const auto one = rig.transport(clock, rig.interrupt);
  const auto other = rig.transport(clock, rig.interrupt);
  std::array<std::uint8_t, 260> into = {};
  const auto ask = [&](link::Transport& transport, const Bytes& request) {
    REQUIRE(transport.send(request, clock.now() + 1s).has_value());
    return transport.receive(into, clock.now() + 1s).value();
  };
  CHECK(ask(*one, arm) == arm.size());
  CHECK(ask(*other, read_two) == 0);
  CHECK(ask(*other, reset_alarm) == reset_alarm.size());
  // The event is the first's alone, although the other drove the tool meanwhile.
  CHECK(other->receive(into, clock.now()).value() == 0);
  CHECK(one->receive(into, clock.now() + 1s).value() == 37);
}
