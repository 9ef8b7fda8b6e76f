#include "spindle/device/event_source.hpp"

#include <doctest/doctest.h>

#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "spindle/files/profile_store.hpp"
#include "spindle/sim/plain_tool.hpp"
#include "spindle/sim/sim_transport.hpp"
#include "support/fake_clock.hpp"

using namespace spindle;
using namespace std::chrono_literals;
using catalogue::EventKind;
using device::EventMode;
using device::EventNews;
using device::EventOrigin;
using device::EventSource;
using device::GapNews;

namespace {

constexpr std::uint16_t flag_register = 294;
constexpr std::uint16_t block_register = 295;

/// Loses answers to reads of one register, and remembers what was asked.
class Forgetful final : public sim::Server {
 public:
  explicit Forgetful(sim::PlainTool& tool) : tool_(&tool) {}

  std::optional<modbus::Pdu> answer(sim::ConnectionId connection, modbus::UnitId unit,
                                    const modbus::Pdu& request, TimePoint now) override {
    const std::uint16_t first = get_u16(request.data, 0);
    asked.push_back(first);
    auto answered = tool_->answer(connection, unit, request, now);
    if (behind_flag && first == flag_register) tool_->happen(*std::exchange(behind_flag, {}), now);
    if (interrupt != nullptr && first == interrupted_at) {
      std::exchange(interrupt, nullptr)->raise(2);
      return std::nullopt;
    }
    if (lost > 0 && first == lost_at) {
      --lost;
      return std::nullopt;
    }
    return answered;
  }
  void advance(TimePoint now) override { tool_->advance(now); }
  [[nodiscard]] std::optional<TimePoint> next_change() const override {
    return tool_->next_change();
  }
  std::vector<sim::Push> take_pushes() override { return tool_->take_pushes(); }
  std::vector<sim::Push> take_pushes(sim::ConnectionId connection) override {
    return tool_->take_pushes(connection);
  }
  void connected(sim::ConnectionId connection) override { tool_->connected(connection); }
  void disconnected(sim::ConnectionId connection) override { tool_->disconnected(connection); }

  std::vector<std::uint16_t> asked = {};
  std::uint16_t lost_at = 0;
  int lost = 0;
  std::optional<EventKind> behind_flag = std::nullopt;
  std::uint16_t interrupted_at = 0;
  Interrupt* interrupt = nullptr;  ///< comes instead of the answer, once

 private:
  sim::PlainTool* tool_;
};

/// A tool by a profile of its own, and what its source of events tells.
class Bench {
 public:
  explicit Bench(const std::string& name, void (*change)(catalogue::EventFacts&) = nullptr) {
    const files::ProfileStore store({SPINDLE_SOURCE_DIR "/tests/profiles/good"});
    profile = store.load(name).value();
    if (change != nullptr) change(*profile.events);
    tool = sim::make_plain_tool(profile, store.load_simulation(name).value(), {});
    server = std::make_unique<Forgetful>(*tool);
    source = EventSource::make(profile, EventMode::declared, clock, [this](const auto& news) {
      if (const auto* event = std::get_if<EventNews>(&news)) events.push_back(*event);
      if (const auto* gap = std::get_if<GapNews>(&news)) gaps.push_back(*gap);
    });
  }

  Result<void> connect() {
    const auto open = [this](const auto&, const auto&,
                             Duration) -> Result<std::unique_ptr<link::Transport>> {
      return sim::make_sim_transport(*server, {++connections}, modbus::Framing::tcp, {}, answers,
                                     clock, interrupt);
    };
    auto opened =
        device::Device::open(link::parse_endpoint("tcp://tool").value(), profile, {}, open, clock);
    REQUIRE(opened.has_value());
    device = std::make_unique<device::Device>(std::move(*opened));
    return source->attach(*device, 1s);
  }
  void happen(EventKind kind = EventKind::fastening_ok) { tool->happen(kind, clock.now()); }
  void lose(std::uint16_t first, int count) {
    server->lost_at = first;
    server->lost = count;
  }

  Interrupt interrupt;
  test::FakeClock clock{interrupt};
  sim::AnswerCounter answers;
  std::uint32_t connections = 0;
  catalogue::Profile profile;
  std::unique_ptr<sim::PlainTool> tool;
  std::unique_ptr<Forgetful> server;
  std::unique_ptr<device::Device> device;
  std::vector<EventNews> events;
  std::vector<GapNews> gaps;
  std::unique_ptr<EventSource> source;
};

}  // namespace

TEST_CASE("a source is made by the profile, and none where nothing is wanted or there") {
  Bench bench("kducer");
  CHECK(bench.source != nullptr);
  CHECK(EventSource::make(bench.profile, EventMode::none, bench.clock, {}) == nullptr);
  bench.profile.events.reset();
  CHECK(EventSource::make(bench.profile, EventMode::declared, bench.clock, {}) == nullptr);
}

TEST_CASE("flag: each result is told once, and nothing where there is none") {
  Bench bench("kducer");
  CHECK(bench.source->polls());
  CHECK(!bench.source->caveat().empty());
  REQUIRE(bench.connect());
  REQUIRE(bench.source->poll());
  CHECK(bench.events.empty());
  for (int i = 0; i < 3; ++i) {
    bench.happen();
    REQUIRE(bench.source->poll());
    REQUIRE(bench.source->poll());
  }
  CHECK(bench.events.size() == 3);
  CHECK(bench.events.front().source == EventOrigin::poll);
  CHECK(bench.gaps.empty());
}

TEST_CASE("flag: what waits when the watch begins is told") {
  Bench bench("kducer");
  bench.happen(EventKind::fastening_ng);
  REQUIRE(bench.connect());
  REQUIRE(bench.events.size() == 1);
  CHECK(bench.events.front().source == EventOrigin::catch_up);
  CHECK(bench.gaps.empty());
}

TEST_CASE("flag: the lost answer to its reading is never asked for again, the block is looked at") {
  Bench bench("kducer");
  REQUIRE(bench.connect());
  bench.server->asked.clear();
  bench.happen();
  bench.lose(flag_register, 1);
  REQUIRE(bench.source->poll());
  CHECK(bench.server->asked == std::vector<std::uint16_t>{flag_register, block_register});
  CHECK(bench.events.size() == 1);
  CHECK(bench.gaps.empty());
}

TEST_CASE("flag: where the block is the one before, a lost answer is a gap") {
  Bench bench("kducer");
  REQUIRE(bench.connect());
  bench.lose(flag_register, 1);
  REQUIRE(bench.source->poll());
  CHECK(bench.events.empty());
  REQUIRE(bench.gaps.size() == 1);
  CHECK(bench.gaps.front().missed == std::nullopt);
}

TEST_CASE("flag: a result that can not be read is a gap, and is fetched on the next connection") {
  Bench bench("kducer");
  REQUIRE(bench.connect());
  bench.happen();
  bench.lose(block_register, 2);  // once more for the repetition
  CHECK(!bench.source->poll().has_value());
  REQUIRE(bench.gaps.size() == 1);
  CHECK(bench.gaps.front().reason.find("could not be read") != std::string::npos);
  CHECK(bench.events.empty());
  REQUIRE(bench.connect());
  CHECK(bench.gaps.size() == 2);  // what else happened meanwhile is not known
  REQUIRE(bench.events.size() == 1);
  CHECK(bench.events.front().source == EventOrigin::catch_up);
  REQUIRE(bench.connect());
  CHECK(bench.events.size() == 1);
}

TEST_CASE("flag: a result that comes before the one before it was read is one that is missed") {
  Bench bench("kducer");
  REQUIRE(bench.connect());
  bench.happen();
  bench.server->behind_flag = EventKind::fastening_ng;
  REQUIRE(bench.source->poll());
  CHECK(bench.events.size() == 1);
  CHECK(bench.gaps.empty());
  REQUIRE(bench.source->poll());
  CHECK(bench.events.size() == 1);
  REQUIRE(bench.gaps.size() == 1);
  CHECK(bench.gaps.front().missed == 1U);
}

TEST_CASE("flag: another tool is not compared with the one before") {
  Bench bench("kducer");
  REQUIRE(bench.connect());
  bench.source->forget();
  REQUIRE(bench.connect());
  CHECK(bench.gaps.empty());
}

TEST_CASE("flag: no device reads it but for its source") {
  Bench bench("kducer");
  bench.happen();
  REQUIRE(bench.connect());
  bench.server->asked.clear();
  bench.happen();
  const auto all = bench.profile.select({});
  REQUIRE(all.has_value());
  REQUIRE(bench.device->read_each(*all, device::Limits::skip).has_value());
  CHECK(std::count(bench.server->asked.begin(), bench.server->asked.end(), flag_register) == 0);
  REQUIRE(bench.source->poll());
  CHECK(bench.events.size() == 2);
}

TEST_CASE("counter: what was missed is counted, and nothing is armed") {
  Bench bench("countermatic");
  CHECK(bench.source->polls());
  CHECK(bench.source->caveat().empty());
  CHECK(bench.source->next_due() == TimePoint::max());
  REQUIRE(bench.connect());
  bench.happen();
  REQUIRE(bench.source->poll());
  bench.happen();
  bench.happen(EventKind::fastening_ng);
  bench.happen();
  REQUIRE(bench.source->poll());
  CHECK(bench.events.size() == 2);
  REQUIRE(bench.gaps.size() == 1);
  CHECK(bench.gaps.front().missed == 2U);
}

TEST_CASE("counter: a block that is longer than a request is read in pieces") {
  Bench bench("countermatic");
  REQUIRE(bench.connect());
  bench.happen();
  REQUIRE(bench.source->poll());
  REQUIRE(bench.events.size() == 1);
  CHECK(bench.events.front().block.size() == 25);
  CHECK(bench.events.front().block.back() == 42);
}

TEST_CASE("push without arming: frames come by themselves, and nothing is switched on or off") {
  Bench bench("countermatic",
              [](catalogue::EventFacts& events) { events.model = catalogue::EventModel::push; });
  CHECK(!bench.source->polls());
  REQUIRE(bench.connect());
  CHECK(bench.source->next_due() == TimePoint::max());
  const std::size_t asked = bench.server->asked.size();
  bench.happen();
  bench.happen(EventKind::fastening_ng);
  const auto frame = bench.device->session().next_spontaneous(bench.clock.now() + 10ms);
  REQUIRE((frame && *frame));
  bench.source->handle(**frame);
  bench.source->handle_waiting();
  REQUIRE(bench.events.size() == 2);
  CHECK(bench.events.front().source == EventOrigin::push);
  REQUIRE(bench.source->run_due([](const auto& request) { return request(); }));
  bench.source->disarm();
  CHECK(bench.server->asked.size() == asked);
  CHECK(bench.gaps.empty());
}

TEST_CASE("flag: an interrupt takes no result with it") {
  for (const std::uint16_t asked : {flag_register, block_register}) {
    CAPTURE(asked);
    Bench bench("kducer");
    REQUIRE(bench.connect());
    bench.happen();
    bench.server->interrupted_at = asked;
    bench.server->interrupt = &bench.interrupt;
    const auto polled = bench.source->poll();
    REQUIRE(!polled.has_value());
    CHECK(polled.error().code == Errc::interrupted);
    CHECK(bench.events.size() == 1);
    CHECK(bench.gaps.empty());
  }
}

TEST_CASE("flag: an interrupt is no gap where nothing happened") {
  Bench bench("kducer");
  REQUIRE(bench.connect());
  bench.server->interrupted_at = flag_register;
  bench.server->interrupt = &bench.interrupt;
  CHECK(!bench.source->poll().has_value());
  CHECK(bench.events.empty());
  CHECK(bench.gaps.empty());
}
