#include "spindle/device/watcher.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "support/rig.hpp"

using namespace spindle;
using namespace std::chrono_literals;
using device::EventGap;
using device::EventMode;
using device::EventOrigin;
using device::LinkChange;
using device::LinkState;
using device::PolledValue;
using device::PollLag;
using device::Reconnection;
using device::Samples;
using device::Standing;
using device::ToolEvent;
using device::WatchControl;
using device::Watcher;
using device::WatchEvent;
using device::WatchPlan;

namespace {

constexpr std::uint8_t read_input = 0x04;
constexpr std::uint8_t write_single = 0x06;
constexpr std::uint8_t report_server_id = 0x11;

test::Product product_with_keep_alive() {
  test::Product made = test::small_bm();
  made.profile.link.keep_alive = 1s;
  made.profile.identity->models = {{3, "3204"}};
  made.profile.identity->firmware_below = 4000;
  return made;
}

/// A simulated tool, the wire to it, and everything that is told of it.
struct Workshop : test::BmRig {
  explicit Workshop(const sim::DeviceOptions& how = {}) : BmRig(product_with_keep_alive(), how) {}

  /// Another tool on the same address; the old one lives on as long as the lines to it.
  void replace_tool(const sim::DeviceOptions& how) {
    wire.cut();
    gone = std::exchange(tool, test::simulated(product_with_keep_alive(), how));
  }

  [[nodiscard]] Result<void> watch(Duration time) {
    const TimePoint end = clock.now() + time;
    Watcher watcher([this] { return link(); },
                    [this](const catalogue::Profile&) -> Result<WatchPlan> { return plan; },
                    reconnection, clock, [this](const WatchEvent& one) { return hear(one); });
    auto watched = watcher.run([end] { return end; });
    unreached = watcher.unreached();
    return watched;
  }

  template <typename Kind>
  [[nodiscard]] std::vector<Kind> told() const {
    std::vector<Kind> chosen;
    for (const WatchEvent& one : news) {
      if (const auto* kind = std::get_if<Kind>(&one)) chosen.push_back(*kind);
    }
    return chosen;
  }
  [[nodiscard]] std::vector<std::uint16_t> numbers() const {
    std::vector<std::uint16_t> all;
    for (const ToolEvent& event : told<ToolEvent>()) all.push_back(event.block.front());
    return all;
  }
  [[nodiscard]] std::vector<TimePoint> times(std::uint8_t function) const {
    std::vector<TimePoint> all;
    for (const auto& [at, pdu] : wire.requests) {
      if (pdu.function == function) all.push_back(at);
    }
    return all;
  }
  /// An event at once; error 116 may happen as often as a test wants.
  void happen() { tool->raise_alarm(1, 116, clock.now()); }
  /// Not by the watcher, but on its connection.
  void switch_output(std::uint16_t value) {
    tool->answer({wire.connections}, {}, modbus::write_request({arm_register}, value), clock.now());
  }

  WatchPlan plan = {};
  Reconnection reconnection = Reconnection::forever;
  std::vector<WatchEvent> news = {};
  std::vector<TimePoint> event_heard = {};
  std::optional<Error> unreached = std::nullopt;
  std::size_t wanted = 1'000'000;  ///< news, then stop
  std::unique_ptr<sim::SimulatedBus> gone = nullptr;

 private:
  Result<Watcher::Link> link() {
    auto device = connect();
    if (!device) return tl::unexpected(device.error());
    if (auto known = device->require_known_registers(); !known) {
      return tl::unexpected(known.error());
    }
    std::string identity = device->identity_text();
    return Watcher::Link{std::move(*device), std::move(identity)};
  }
  WatchControl hear(const WatchEvent& one) {
    news.push_back(one);
    if (std::holds_alternative<ToolEvent>(one)) event_heard.push_back(clock.now());
    return news.size() < wanted ? WatchControl::go_on : WatchControl::stop;
  }
};

Duration longest_pause(const std::vector<TimePoint>& times) {
  Duration longest = Duration::zero();
  for (std::size_t at = 1; at < times.size(); ++at) {
    longest = std::max(longest, times[at] - times[at - 1]);
  }
  return longest;
}

bool reads_full_block(const test::Wire::Request& asked) {
  return asked.pdu.function == read_input && get_u16(asked.pdu.data, 2) == 14;
}

/// An operator who works every two seconds; a run-down takes less.
sim::DeviceOptions busy(unsigned ng_every = 0) {
  return {.rundown_every = 2s, .ng_every = ng_every};
}

}  // namespace

TEST_CASE("pushed events are told once each, in order, with their blocks") {
  Workshop shop(busy(3));
  REQUIRE(shop.watch(60s));
  const auto numbers = shop.numbers();
  REQUIRE(numbers.size() > 20);
  for (std::size_t at = 0; at < numbers.size(); ++at) CHECK(numbers[at] == 1962 + at);
  for (const ToolEvent& event : shop.told<ToolEvent>()) {
    CHECK(event.source == EventOrigin::push);
    CHECK(event.block.size() == 14);
  }
  CHECK(shop.told<EventGap>().empty());
}

TEST_CASE("the old event is not a result") {
  Workshop shop;
  REQUIRE(shop.watch(3s));
  CHECK(shop.numbers().empty());
  REQUIRE(shop.news.size() == 1);
  CHECK(shop.told<LinkChange>().front().message == "connected: serial 1021100042, firmware 2103");
}

TEST_CASE("what was pushed before the counter was read is old") {
  Workshop shop;
  shop.wire.before = [&](const modbus::Pdu& request) {
    if (request.function != read_input || get_u16(request.data, 2) != 1) return;
    shop.switch_output(1);
    shop.happen();
    shop.happen();
    shop.wire.before = {};
  };
  REQUIRE(shop.watch(3s));
  CHECK(shop.numbers().empty());
  CHECK(shop.told<EventGap>().empty());
}

TEST_CASE("what is pushed while the last event is fetched keeps its place") {
  Workshop shop;
  const auto while_fetching = [&](const std::function<void()>& what) {
    shop.wire.before = [&shop, what](const modbus::Pdu& request) {
      if (request.function != read_input || get_u16(request.data, 2) != 13) return;
      shop.wire.before = {};
      what();
    };
    REQUIRE(shop.watch(3s));
    CHECK(shop.told<EventGap>().empty());
  };
  SUBCASE("the fetched one was pushed too") {
    while_fetching([&] {
      shop.happen();
      shop.happen();
    });
    CHECK(shop.numbers() == std::vector<std::uint16_t>{1962, 1963});
    CHECK(shop.told<ToolEvent>().back().source == EventOrigin::push);
  }
  SUBCASE("the fetched one was not pushed") {
    while_fetching([&] {
      shop.happen();
      shop.switch_output(0);
      shop.happen();
    });
    CHECK(shop.numbers() == std::vector<std::uint16_t>{1962, 1963});
    CHECK(shop.told<ToolEvent>().back().source == EventOrigin::catch_up);
  }
}

TEST_CASE("output is armed again in time, the tool kept alive, and no block is read whole") {
  Workshop shop(busy());
  REQUIRE(shop.watch(60s));
  const auto arms = shop.times(write_single);
  REQUIRE(arms.size() >= 12);
  CHECK(longest_pause(arms) <= shop.profile.events->arm->every);
  CHECK(longest_pause(shop.times(report_server_id)) <= 1s);
  CHECK(std::none_of(shop.wire.requests.begin(), shop.wire.requests.end(), reads_full_block));
  for (std::size_t at = 0; at + 1 < shop.wire.requests.size(); ++at) {
    CHECK_FALSE(shop.wire.requests[at].is(write_single, 4002, 0));
  }
  CHECK(shop.wire.requests.back().is(write_single, 4002, 0));
}

TEST_CASE("the tool is disarmed on every way out") {
  Workshop shop(busy());
  SUBCASE("at its end") { CHECK(shop.watch(5s)); }
  SUBCASE("when no more is wanted") {
    shop.wanted = 2;
    CHECK(shop.watch(60s));
    CHECK(shop.news.size() == 2);
  }
  SUBCASE("after an interrupt") {
    shop.clock.at(shop.clock.now() + 5s, [&] { shop.interrupt.raise(15); });
    const auto watched = shop.watch(60s);
    REQUIRE_FALSE(watched);
    CHECK(watched.error().code == Errc::terminated);
  }
  SUBCASE("after a refused value") {
    shop.plan.values = {catalogue::parse_raw_register("@holding:9999")->value()};
    const auto watched = shop.watch(60s);
    REQUIRE_FALSE(watched);
    CHECK(watched.error().code == Errc::exception_response);
    CHECK(watched.error().name == "@holding:9999");
    CHECK(shop.told<LinkChange>().size() == 1);
  }
  CHECK(shop.wire.requests.back().is(write_single, 4002, 0));
}

TEST_CASE("an interrupt ends the wait for a tool that is not there") {
  Workshop shop;
  shop.wire.unreachable_until = TimePoint::max();
  shop.clock.at(shop.clock.now() + 25s, [&] { shop.interrupt.raise(2); });
  const auto watched = shop.watch(3600s);
  REQUIRE_FALSE(watched);
  CHECK(watched.error().code == Errc::interrupted);
  CHECK(shop.clock.now() == test::FakeClock::start + 25s);
}

TEST_CASE("attempts come at once, then after 0.25 s, doubling up to 10 s, a fifth less at most") {
  Workshop shop;
  shop.wire.unreachable_until = TimePoint::max();
  REQUIRE(shop.watch(120s));
  const auto links = shop.told<LinkChange>();
  REQUIRE(links.size() == shop.wire.attempts.size());
  REQUIRE(links.size() > 10);
  CHECK(shop.wire.attempts.front() == test::FakeClock::start);
  Duration even = 250ms;
  bool jitters = false;
  for (std::size_t at = 1; at < shop.wire.attempts.size();
       ++at, even = std::min<Duration>(10s, 2 * even)) {
    const Duration pause = shop.wire.attempts[at] - shop.wire.attempts[at - 1];
    CAPTURE(at);
    CHECK(pause <= even);
    CHECK(pause >= even * 4 / 5);
    jitters = jitters || pause != even;
    CHECK(links[at].attempt == at + 1);
    CHECK(links[at].state == LinkState::connecting);
  }
  CHECK(jitters);
  CHECK(shop.unreached);
  CHECK(shop.unreached->code == Errc::connection_refused);
}

TEST_CASE("after a lost link the missed events are a gap and the last one is fetched") {
  Workshop shop(busy());
  // Run-downs end about every two seconds; the line is away for ten of them.
  shop.clock.at(shop.clock.now() + 10s, [&] {
    shop.wire.cut();
    shop.wire.unreachable_until = shop.clock.now() + 20s;
  });
  REQUIRE(shop.watch(60s));
  const auto links = shop.told<LinkChange>();
  REQUIRE(links.size() > 4);
  CHECK(links[0].state == LinkState::connected);
  CHECK(links[1].state == LinkState::lost);
  CHECK(links[2].state == LinkState::reconnecting);
  CHECK(links.back().state == LinkState::connected);

  const auto gaps = shop.told<EventGap>();
  REQUIRE(gaps.size() == 1);
  REQUIRE(gaps.front().missed);
  CHECK(*gaps.front().missed > 5);
  const auto events = shop.told<ToolEvent>();
  std::uint32_t jumps = 0;
  for (std::size_t at = 1; at < events.size(); ++at) {
    const std::uint32_t step = events[at].block.front() - events[at - 1].block.front();
    if (step == 1) continue;
    ++jumps;
    CHECK(step == *gaps.front().missed + 1);
    CHECK(events[at].source == EventOrigin::catch_up);
  }
  CHECK(jumps == 1);
}

TEST_CASE("a link that never serves is tried ever more seldom") {
  Workshop shop;
  shop.faults = {sim::parse_fault("close@every:3").value()};
  REQUIRE(shop.watch(60s));
  CHECK(shop.wire.attempts.size() < 14);
  CHECK(shop.told<LinkChange>().size() > 6);
}

TEST_CASE("a link whose values were polled has served, and attempts are counted anew") {
  Workshop shop;
  shop.profile.link.keep_alive = Duration::zero();  // as serial lines do without
  shop.plan.events = EventMode::none;
  shop.plan.values = {shop.profile.find("status.running").value()};
  for (const Duration after : {5s, 15s, 25s}) {
    shop.clock.at(shop.clock.now() + after, [&] {
      shop.wire.cut();
      shop.wire.unreachable_until = shop.clock.now() + 1s;
    });
  }
  REQUIRE(shop.watch(30s));
  const auto links = shop.told<LinkChange>();
  std::size_t lost = 0;
  for (std::size_t at = 1; at < links.size(); ++at) {
    if (links[at - 1].state != LinkState::lost) continue;
    ++lost;
    CHECK(links[at].state == LinkState::reconnecting);
    CHECK(links[at].attempt == 1);
  }
  CHECK(lost == 3);
}

TEST_CASE("one lost answer to a keep-alive or an arming is no reason to reconnect") {
  Workshop shop(busy());
  shop.profile.link.retries = 1;
  shop.faults = {sim::parse_fault("lost@every:7").value()};
  REQUIRE(shop.watch(60s));
  CHECK(shop.told<LinkChange>().size() == 1);
  CHECK(shop.told<EventGap>().empty());
  CHECK(shop.numbers().size() > 20);
}

TEST_CASE("a tool that is busy for a moment is asked again, and nothing is lost in silence") {
  Workshop shop(busy());
  shop.faults = {sim::parse_fault("exception=6@every:7").value()};
  REQUIRE(shop.watch(120s));
  std::size_t lost = 0;
  for (const LinkChange& link : shop.told<LinkChange>())
    lost += link.state == LinkState::lost ? 1 : 0;
  CHECK(lost > 3);
  std::uint32_t missed = 0;
  for (const EventGap& gap : shop.told<EventGap>()) missed += gap.missed.value_or(0);
  const auto numbers = shop.numbers();
  REQUIRE(numbers.size() > 20);
  CHECK(numbers.back() - numbers.front() + 1U == numbers.size() + missed);
}

TEST_CASE("a restarted tool is said, and what stands in its registers is no event") {
  Workshop shop(busy());
  shop.clock.at(shop.clock.now() + 10s, [&] {
    shop.tool->reboot(shop.clock.now());
    shop.wire.cut();
  });
  REQUIRE(shop.watch(20s));
  const auto gaps = shop.told<EventGap>();
  REQUIRE(gaps.size() == 1);
  CHECK_FALSE(gaps.front().missed);
  CHECK(gaps.front().reason.find("restarted") != std::string::npos);
  const auto numbers = shop.numbers();
  CHECK(std::count(numbers.begin(), numbers.end(), 0) == 0);
  CHECK(std::count(numbers.begin(), numbers.end(), 1) == 1);
  CHECK(std::count(numbers.begin(), numbers.end(), 2) == 1);
}

TEST_CASE("a counter that comes to the last number, or just past it, hides no events") {
  Workshop shop;
  shop.tool->reboot(shop.clock.now());
  const auto happen = [&](std::uint16_t code, int times) {
    for (int time = 0; time < times; ++time) shop.tool->raise_alarm(1, code, shop.clock.now());
  };
  happen(115, 20);
  int since = 0;
  SUBCASE("to it") { since = 20; }
  SUBCASE("just past it") { since = 21; }
  SUBCASE("farther") { since = 30; }
  shop.clock.at(shop.clock.now() + 5s, [&] {
    shop.wire.cut();
    shop.tool->reboot(shop.clock.now());
    happen(116, since);
  });
  REQUIRE(shop.watch(10s));
  const auto gaps = shop.told<EventGap>();
  REQUIRE(gaps.size() == 1);
  CHECK_FALSE(gaps.front().missed);
  const auto events = shop.told<ToolEvent>();
  REQUIRE(events.size() == 1);
  CHECK(events.front().block.front() == since);
  CHECK(events.front().source == EventOrigin::catch_up);
}

TEST_CASE("what a restarted tool remembers is told as such, and what it pushes is a result") {
  Workshop shop;
  shop.clock.at(shop.clock.now() + 5s, [&] {
    shop.wire.cut();
    shop.tool->reboot(shop.clock.now());
    shop.happen();
  });
  shop.clock.at(shop.clock.now() + 8s, [&] { shop.happen(); });
  REQUIRE(shop.watch(10s));
  const auto events = shop.told<ToolEvent>();
  REQUIRE(events.size() == 2);
  CHECK(events[0].block.front() == 1);
  CHECK(events[0].standing == Standing::remembered);
  CHECK(events[1].block.front() == 2);
  CHECK(events[1].source == EventOrigin::push);
  CHECK(events[1].standing == Standing::result);
}

TEST_CASE("an event that was missed for a moment is a result, and no doubt about its number") {
  Workshop shop;
  shop.clock.at(shop.clock.now() + 5s, [&] {
    shop.wire.cut();
    shop.happen();
  });
  REQUIRE(shop.watch(10s));
  const auto events = shop.told<ToolEvent>();
  REQUIRE(events.size() == 1);
  CHECK(events.front().source == EventOrigin::catch_up);
  CHECK(events.front().standing == Standing::result);
  CHECK(shop.told<EventGap>().empty());
}

TEST_CASE("a first connection lost before it served raises no doubt about the next number") {
  Workshop shop;
  shop.clock.advance(1h);  // a computer that has been on for long
  shop.wire.before = [&](const modbus::Pdu& request) {
    if (request.function != write_single) return;
    shop.wire.before = {};
    shop.wire.cut();
    shop.happen();
    shop.happen();
  };
  REQUIRE(shop.watch(10s));
  const auto gaps = shop.told<EventGap>();
  REQUIRE(gaps.size() == 1);
  CHECK(gaps.front().missed == 1U);
  CHECK(shop.numbers().size() == 1);
}

TEST_CASE("another tool or firmware behind the address is said, and its old event is no result") {
  Workshop shop;
  sim::DeviceOptions other;
  SUBCASE("serial") { other.serial = 1021100099; }
  SUBCASE("firmware") { other.firmware = 2200; }
  shop.clock.at(shop.clock.now() + 3s, [&] { shop.replace_tool(other); });
  REQUIRE(shop.watch(10s));
  const auto links = shop.told<LinkChange>();
  REQUIRE(links.size() == 3);
  CHECK(links[2].message.starts_with("not the tool of before: serial "));
  CHECK(links[2].message.find("before: serial 1021100042, firmware 2103") != std::string::npos);
  REQUIRE(shop.told<EventGap>().size() == 1);
  CHECK_FALSE(shop.told<EventGap>().front().missed);
  CHECK(shop.numbers().empty());
}

TEST_CASE("another product ends the watch, because no retry mends it") {
  Workshop shop;
  shop.clock.at(shop.clock.now() + 3s,
                [&] { shop.replace_tool({.firmware = std::uint16_t{4001}}); });
  const auto watched = shop.watch(10s);
  REQUIRE_FALSE(watched);
  CHECK(watched.error().code == Errc::wrong_generation);
}

TEST_CASE("without reconnection the first trouble ends it") {
  Workshop shop(busy());
  shop.reconnection = Reconnection::never;
  SUBCASE("the link is lost") {
    shop.clock.at(shop.clock.now() + 5s, [&] { shop.wire.cut(); });
    const auto watched = shop.watch(60s);
    REQUIRE_FALSE(watched);
    CHECK(watched.error().code == Errc::closed);
    CHECK(shop.told<LinkChange>().back().state == LinkState::lost);
  }
  SUBCASE("the tool is not there") {
    shop.wire.unreachable_until = TimePoint::max();
    const auto watched = shop.watch(60s);
    REQUIRE_FALSE(watched);
    CHECK(watched.error().code == Errc::connection_refused);
    CHECK(shop.news.empty());
  }
  CHECK(shop.wire.attempts.size() == 1);
}

TEST_CASE("an event is told at once, however long a keep-alive goes without an answer") {
  Workshop shop;
  shop.faults = {sim::parse_fault("lost@every:3").value()};
  std::vector<TimePoint> happened;
  shop.wire.before = [&](const modbus::Pdu& request) {
    if (request.function != report_server_id || shop.wire.requests.size() < 6) return;
    happened.push_back(shop.clock.now());
    shop.happen();
  };
  REQUIRE(shop.watch(20s));
  const auto told = shop.told<ToolEvent>();
  REQUIRE(told.size() > 10);
  REQUIRE(shop.event_heard.size() <= happened.size());
  for (std::size_t at = 0; at < shop.event_heard.size(); ++at) {
    CHECK(shop.event_heard[at] - happened[at] < 10ms);
  }
}

TEST_CASE("a counter that runs away from its polls is told as it was seen") {
  Workshop shop;
  shop.plan.events = EventMode::unarmed;
  std::uint16_t last = 0;
  shop.wire.before = [&](const modbus::Pdu& request) {
    if (request.function != read_input) return;
    shop.happen();
    last = static_cast<std::uint16_t>(last + 1);
  };
  REQUIRE(shop.watch(3s));
  CHECK(shop.told<LinkChange>().size() == 1);
  std::uint32_t missed = 0;
  for (const EventGap& gap : shop.told<EventGap>()) {
    CHECK(gap.reason == "events came faster than they could be read");
    missed += gap.missed.value_or(0);
  }
  CHECK(missed > 10);
  CHECK(missed <= last);
}

TEST_CASE("polling the counter finds every event and arms nothing") {
  Workshop shop(busy());
  shop.plan.events = EventMode::unarmed;
  REQUIRE(shop.watch(60s));
  const auto numbers = shop.numbers();
  REQUIRE(numbers.size() > 20);
  for (std::size_t at = 0; at < numbers.size(); ++at) CHECK(numbers[at] == 1962 + at);
  CHECK(shop.told<ToolEvent>().front().source == EventOrigin::poll);
  CHECK(shop.times(write_single).empty());
  CHECK(std::none_of(shop.wire.requests.begin(), shop.wire.requests.end(), reads_full_block));
}

TEST_CASE("events that come between two polls are a gap") {
  Workshop shop(busy());
  shop.plan.events = EventMode::unarmed;
  shop.plan.interval = 10s;
  REQUIRE(shop.watch(35s));
  const auto gaps = shop.told<EventGap>();
  REQUIRE(gaps.size() >= 2);
  CHECK(gaps.front().reason == "events came faster than they were polled");
}

TEST_CASE("values are told when they change, first, or always") {
  Workshop shop(busy());
  shop.plan.events = EventMode::none;
  shop.plan.values = {shop.profile.find("status.running").value()};
  const auto watched = [&](Samples samples) {
    shop.plan.samples = samples;
    REQUIRE(shop.watch(10s));
    return shop.told<PolledValue>();
  };
  SUBCASE("changes") {
    const auto values = watched(Samples::changes);
    REQUIRE(values.size() > 4);
    for (const PolledValue& value : values) {
      REQUIRE(value.previous);
      CHECK_FALSE(*value.previous == value.value);
    }
  }
  SUBCASE("the first too") {
    const auto values = watched(Samples::changes_and_first);
    REQUIRE(values.size() > 4);
    CHECK_FALSE(values.front().previous);
    CHECK(values[1].previous);
  }
  SUBCASE("all") { CHECK(watched(Samples::all).size() == 50); }
  CHECK(shop.numbers().empty());
  CHECK(shop.times(write_single).empty());
}

namespace {

/// A tool of which only values are read, and which hangs up behind every answer.
struct HangingUp : Workshop {
  HangingUp() {
    profile.link.keep_alive = Duration::zero();
    profile.identity.reset();
    profile.events.reset();
    plan.events = EventMode::none;
    plan.samples = Samples::all;
    plan.values = {profile.find("status.running").value()};
    faults = {sim::parse_fault("close-after@every:1").value()};
  }
};

}  // namespace

TEST_CASE("a tool that hangs up behind every answer is connected on the beat of the interval") {
  HangingUp shop;
  shop.plan.interval = 5s;
  REQUIRE(shop.watch(60s));
  const auto polled = shop.times(read_input);
  REQUIRE(polled.size() >= 12);
  REQUIRE(polled.size() <= 13);
  for (std::size_t at = 1; at < polled.size(); ++at) {
    CHECK(polled[at] - polled[at - 1] > 4990ms);
    CHECK(polled[at] - polled[at - 1] < 5010ms);
  }
  CHECK(shop.wire.attempts.size() <= polled.size() + 1);
}

TEST_CASE("pauses grow until a connection has lasted") {
  HangingUp shop;
  shop.plan.interval = 200ms;
  REQUIRE(shop.watch(60s));
  // At 0, 0, 0.25, 0.75, 1.75, 3.75, 7.75, 15.75 s and then every ten seconds, or a fifth sooner.
  CHECK(shop.wire.attempts.size() > 8);
  CHECK(shop.wire.attempts.size() < 18);
  CHECK(longest_pause(shop.wire.attempts) > 7s);
  CHECK(longest_pause(shop.wire.attempts) <= 10100ms);
}

TEST_CASE("a beat that was missed is told, at once and then once a minute") {
  Workshop shop;
  shop.plan.events = EventMode::none;
  shop.plan.samples = Samples::all;
  shop.plan.values = {shop.profile.find("status.running").value()};
  shop.plan.interval = 10ms;
  SUBCASE("a tool that is quick enough") {
    REQUIRE(shop.watch(10s));
    CHECK(shop.told<PollLag>().empty());
    CHECK(shop.told<PolledValue>().size() == 1000);
  }
  SUBCASE("one that needs 25 ms") {
    shop.faults = {sim::parse_fault("latency=25ms").value()};
    REQUIRE(shop.watch(90s));
    const auto lags = shop.told<PollLag>();
    REQUIRE(lags.size() == 3);  // at once, after a minute, and at the end
    CHECK(lags[1].interval == 10ms);
    CHECK(lags[1].achieved > 24ms);
    CHECK(lags[1].achieved < 31ms);
    std::uint64_t missed = 0;
    for (const PollLag& lag : lags) missed += lag.missed;
    const std::uint64_t told = shop.told<PolledValue>().size();
    CHECK(told > 2900);  // one behind the other, without pauses
    CHECK(missed + told > 8980);
    CHECK(missed + told < 9020);
  }
}

TEST_CASE("whole blocks of event and status are polled in parts while output is armed") {
  Workshop shop(busy());
  for (const catalogue::Parameter& parameter : shop.profile.parameters) {
    if (parameter.table == modbus::RegisterTable::input) shop.plan.values.push_back(parameter);
  }
  REQUIRE(shop.plan.values.size() > 20);
  REQUIRE(shop.watch(20s));
  CHECK(std::none_of(shop.wire.requests.begin(), shop.wire.requests.end(), reads_full_block));
  CHECK(longest_pause(shop.times(report_server_id)) <= 1s);
}
