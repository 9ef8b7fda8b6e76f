#include <doctest/doctest.h>

#include <string>
#include <utility>
#include <vector>

#include "hex.hpp"
#include "spindle/files/profile_store.hpp"
#include "spindle/modbus/pdu.hpp"
#include "spindle/posix/disk.hpp"
#include "spindle/sim/simulated_tool.hpp"
#include "support/edit_list.hpp"
#include "support/rig.hpp"

using namespace spindle;
using namespace spindle::sim;
using namespace std::chrono_literals;
using modbus::Pdu;
using modbus::RegisterTable;
using spindle::test::hex;

namespace {

constexpr TimePoint start_time = TimePoint(1h);
constexpr ConnectionId client{1};
constexpr ConnectionId other_client{2};

// Addresses of protocol/bm-bmt's remote inputs, as the profile of these tests has them.
constexpr std::uint16_t alarm_reset = 4000;
constexpr std::uint16_t lock = 4001;
constexpr std::uint16_t auto_output = 4002;
constexpr std::uint16_t start = 4003;
constexpr std::uint16_t select_preset = 4004;
constexpr std::uint16_t direction = 4005;

struct Event {
  std::uint16_t number, fastening_time, preset, target_torque, torque, speed, a1, a2, a3,
      screw_count, error, direction, status, snug_angle;
  friend bool operator==(const Event&, const Event&) = default;
};

Event event_of(const Registers& r) {
  REQUIRE(r.size() == 14);
  return {r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7], r[8], r[9], r[10], r[11], r[12], r[13]};
}

struct Status {
  std::uint16_t torque, speed, current, preset, torque_up, fastening_ok, ready, running, alarm,
      direction;
};

// A tool, a client and the time.
struct Bench : test::BmRig {
  explicit Bench(const DeviceOptions& how = {},
                 const catalogue::SimulationSpec& facts = test::bm_start())
      : BmRig({test::bm_profile(), facts}, how) {
    tool->connected(client);
    tool->connected(other_client);
  }

  Pdu ask(const Pdu& request, ConnectionId from = client) {
    const auto response = tool->answer(from, {0}, request, clock.now());
    REQUIRE(response.has_value());
    return *response;
  }

  Registers read(RegisterTable table, std::uint16_t first, std::uint16_t count) {
    const Pdu request = modbus::read_request(table, {first}, count);
    const Pdu response = ask(request);
    REQUIRE(modbus::fit(request, response) == modbus::Fit::answer);
    return modbus::registers_of(response);
  }

  std::uint16_t holding(std::uint16_t address) {
    return read(RegisterTable::holding, address, 1).front();
  }

  void write(std::uint16_t address, std::uint16_t value, ConnectionId from = client) {
    const Pdu request = modbus::write_request({address}, value);
    REQUIRE(ask(request, from) == request);
  }

  // The exception code, 0 for none.
  int refusal(const Pdu& request) { return modbus::exception_of(ask(request)).value_or(0); }

  Event event() { return event_of(read(RegisterTable::input, 3200, 14)); }

  Status status() {
    const Registers r = read(RegisterTable::input, 3300, 10);
    return {r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7], r[8], r[9]};
  }

  std::vector<Event> pushed(ConnectionId to = client) {
    std::vector<Event> events;
    for (const Push& push : tool->take_pushes(to)) {
      CHECK(push.pdu.function == 4);
      CHECK(push.pdu.data.front() == 28);
      events.push_back(event_of(modbus::registers_of(push.pdu)));
    }
    return events;
  }
};

}  // namespace

TEST_CASE("parameters start as the profile says, the unnamed ones at 0") {
  Bench bench;
  // Address 2 and 3 as in the manual's example (60427, 3.1): 2.71 and 10.00 %.
  CHECK(bench.read(RegisterTable::holding, 2, 2) == Registers{271, 1000});
  CHECK(bench.holding(17) == 600);
  CHECK(bench.holding(725) == 0);
  bench.write(2, 300);
  CHECK(bench.holding(2) == 300);
}

TEST_CASE("limits are mirrored, the later pattern wins") {
  Bench bench;
  CHECK(bench.holding(1002) == 20);
  CHECK(bench.holding(2002) == 600);
  CHECK(bench.holding(1700) == 0);
  CHECK(bench.holding(2700) == 60000);
  CHECK(bench.holding(2008) == 9000);
  CHECK(bench.holding(1017) == 20);
  CHECK(bench.holding(1100) == 0);  // no pattern
  CHECK(bench.holding(2100) == 65535);
  CHECK(bench.refusal(modbus::read_request(RegisterTable::holding, {1725}, 1)) == 0x02);
}

TEST_CASE("exceptions") {
  struct Row {
    std::string name;
    Pdu request;
    int code;
  };
  const auto read = [](RegisterTable table, std::uint16_t first, std::uint16_t count) {
    return modbus::read_request(table, {first}, count);
  };
  const auto write = [](std::uint16_t address, std::uint16_t value) {
    return modbus::write_request({address}, value);
  };
  const std::vector<Row> rows = {
      {"inside limits", write(2, 20), 0},
      {"below the minimum", write(2, 19), 0x0E},
      {"at the maximum", write(2, 600), 0},
      {"above the maximum", write(2, 601), 0x0E},
      {"a hole", read(RegisterTable::holding, 564, 1), 0x02},
      {"a block that touches a hole", read(RegisterTable::holding, 560, 5), 0x02},
      {"up to the hole", read(RegisterTable::holding, 560, 4), 0},
      {"behind the hole", read(RegisterTable::holding, 569, 3), 0},
      {"a hole's minimum", read(RegisterTable::holding, 1564, 1), 0x02},
      {"register 0", read(RegisterTable::holding, 0, 2), 0x02},
      {"past the parameters", read(RegisterTable::holding, 725, 2), 0x02},
      {"past the last register", read(RegisterTable::holding, 65535, 1), 0x02},
      {"the wrong table", read(RegisterTable::holding, 3200, 1), 0x02},
      {"as many as fit", read(RegisterTable::holding, 1, 100), 0},
      {"more than fit", read(RegisterTable::holding, 1, 101), 0x03},
      {"writing a hole", write(564, 0), 0x02},
      {"writing a limit", write(1002, 0), 0x02},
      {"writing nothing known", write(4500, 1), 0x02},
      {"reading a remote input", read(RegisterTable::holding, 4003, 1), 0x02},
      {"FC 10h", modbus::write_request({2}, std::vector<std::uint16_t>{300}), 0x01},
      {"FC 08", modbus::loopback_request(7), 0x01},
      {"FC 2Bh", Pdu{0x2B, hex("0E 01 00")}, 0x01},
      {"a short request", Pdu{0x03, hex("0002")}, 0x03},
  };
  for (const Row& row : rows) {
    CAPTURE(row.name);
    Bench bench;
    CHECK(bench.refusal(row.request) == row.code);
  }
}

TEST_CASE("the identity in its forms") {
  struct Row {
    std::string name;
    DeviceOptions options;
    std::string expected;
  };
  const std::vector<Row> rows = {
      {"as the profile has it", {}, "0001 0001 0003 0837 2A000A150A"},
      {"short: the same serial as a number",
       {.identity_bytes = 12},
       "0001 0001 0003 0837 3CDCC00A"},
      {"long", {.identity_bytes = 17}, "0001 0001 0003 0837 2A000A150A 000004D2"},
      {"other firmware and model",
       {.firmware = 4000, .tool_model = 10},
       "0001 0001 000A 0FA0 2A000A150A"},
      {"other serial, short",
       {.identity_bytes = 12, .serial = 1234},
       "0001 0001 0003 0837 000004D2"},
      {"other serial, in pairs", {.serial = 1119103456}, "0001 0001 0003 0837 38220A130B"},
  };
  for (const Row& row : rows) {
    CAPTURE(row.name);
    Bench bench(row.options);
    const Pdu response = bench.ask(modbus::report_server_id_request());
    CHECK(to_hex(modbus::server_id_of(response)) == to_hex(hex(row.expected)));
  }
}

TEST_CASE("an identity whose usual form is short grows into the long one") {
  catalogue::SimulationSpec facts = test::bm_start();
  facts.identity = hex("0001 0001 0003 0837 3CDCC00A 00 000004D2");
  facts.identity_bytes = 12;
  const auto identity = [&facts](const DeviceOptions& options) {
    Bench bench(options, facts);
    const Pdu response = bench.ask(modbus::report_server_id_request());
    return to_hex(modbus::server_id_of(response));
  };
  CHECK(identity({}) == to_hex(hex("0001 0001 0003 0837 3CDCC00A")));
  CHECK(identity({.identity_bytes = 13}) == to_hex(hex("0001 0001 0003 0837 2A000A150A")));
  CHECK(identity({.identity_bytes = 17}) == to_hex(hex("0001 0001 0003 0837 2A000A150A 000004D2")));
}

TEST_CASE("a run-down that reaches its target") {
  Bench bench;
  bench.write(auto_output, 1);
  CHECK(bench.status().ready == 1);
  bench.write(start, 1);
  CHECK(bench.status().running == 1);
  CHECK(bench.status().ready == 0);
  CHECK(bench.tool->next_change() == start_time + 1200ms);

  bench.wait(50ms);  // half of the soft start
  CHECK(bench.status().speed == 117);
  CHECK(bench.status().torque == 0);
  bench.wait(600ms);
  CHECK(bench.status().speed == 235);
  CHECK(bench.status().torque == 0);
  bench.wait(450ms);  // the torque rises
  CHECK(bench.status().torque > 100);
  CHECK(bench.status().torque < 271);
  CHECK(bench.pushed().empty());

  bench.wait(100ms);
  const Status after = bench.status();
  CHECK(after.running == 0);
  CHECK(after.torque_up == 1);
  CHECK(after.fastening_ok == 1);
  CHECK(after.ready == 1);
  CHECK(after.torque == 0);
  CHECK(after.speed == 0);
  CHECK_FALSE(bench.tool->next_change().has_value());

  // 235 rpm are 1410 degrees a second: half of 100 ms, 900 ms, then half of 200 ms.
  const Event event = bench.event();
  CHECK(event == Event{.number = 1962,
                       .fastening_time = 1200,
                       .preset = 1,
                       .target_torque = 271,
                       .torque = 272,
                       .speed = 235,
                       .a1 = 1339,
                       .a2 = 141,
                       .a3 = 1480,
                       .screw_count = 1,
                       .error = 0,
                       .direction = 0,
                       .status = 1,
                       .snug_angle = 0});
  CHECK(bench.pushed() == std::vector<Event>{event});
  CHECK(bench.pushed(other_client).empty());
}

TEST_CASE("a run-down happens at its time however late it is looked at") {
  Bench bench;
  bench.write(auto_output, 1);
  bench.write(start, 1);
  bench.wait(1h);
  CHECK(bench.event().fastening_time == 1200);
  CHECK(bench.pushed().size() == 1);  // the output was armed when it happened
}

TEST_CASE("stopped before its target") {
  Bench bench;
  bench.write(start, 1);
  bench.wait(600ms);
  bench.write(start, 0);
  const Event event = bench.event();
  CHECK(event.status == 2);
  CHECK(event.error == 333);
  CHECK(event.fastening_time == 600);
  CHECK(event.torque == 0);
  CHECK(event.screw_count == 2);
  const Status after = bench.status();
  CHECK(after.running == 0);
  CHECK(after.torque_up == 0);
  CHECK(after.fastening_ok == 0);
  bench.wait(10s);
  CHECK(bench.event().number == event.number);
}

TEST_CASE("a stop without a run is nothing") {
  Bench bench;
  bench.write(start, 0);
  CHECK(bench.event().number == 1961);
}

TEST_CASE("a start is echoed and ignored while running, locked or in alarm") {
  Bench bench;
  bench.write(start, 1);
  bench.wait(600ms);
  bench.write(start, 1);
  bench.wait(600ms);
  CHECK(bench.event().number == 1962);

  bench.write(lock, 1);
  CHECK(bench.status().ready == 0);
  bench.write(start, 1);
  CHECK(bench.status().running == 0);
  bench.tool->operator_rundown(Rundown::ok, bench.clock.now());
  CHECK(bench.status().running == 0);
  bench.write(lock, 0);

  bench.tool->raise_alarm(1, 110, bench.clock.now());
  bench.write(start, 1);
  CHECK(bench.status().running == 0);
  bench.write(alarm_reset, 1);
  bench.write(start, 1);
  CHECK(bench.status().running == 1);
}

TEST_CASE("an alarm ends a run, is an event, and is reset by one") {
  Bench bench;
  bench.write(start, 1);
  bench.wait(100ms);
  bench.tool->raise_alarm(1, 110, bench.clock.now());
  CHECK(bench.status().running == 0);
  CHECK(bench.status().alarm == 110);
  CHECK(bench.read(RegisterTable::input, 3100, 2) == Registers{110, 0});
  CHECK(bench.event().status == 6);
  CHECK(bench.event().error == 110);
  bench.wait(5s);
  CHECK(bench.event().number == 1962);

  bench.write(alarm_reset, 1);
  CHECK(bench.status().alarm == 0);
  CHECK(bench.read(RegisterTable::input, 3100, 2) == Registers{0, 0});
  CHECK(bench.event().status == 5);
  CHECK(bench.event().number == 1963);
}

TEST_CASE("preset and direction") {
  Bench bench;
  bench.write(select_preset, 2);
  CHECK(bench.status().preset == 2);
  Event event = bench.event();
  CHECK(event.status == 4);
  CHECK(event.preset == 2);
  CHECK(event.target_torque == 600);

  for (const std::uint16_t ignored : Registers{0, 4}) bench.write(select_preset, ignored);
  CHECK(bench.status().preset == 2);
  CHECK(bench.event().number == 1962);

  bench.write(start, 1);
  bench.write(select_preset, 1);  // not while it runs
  bench.wait(1200ms);
  event = bench.event();
  CHECK(event.preset == 2);
  CHECK(event.status == 1);
  CHECK(event.snug_angle == event.a2);
  CHECK(event.a2 > 0);

  bench.write(direction, 1);
  CHECK(bench.status().direction == 1);
  CHECK(bench.event().status == 3);
  CHECK(bench.event().direction == 1);
  bench.write(start, 1);
  bench.wait(1000ms);
  event = bench.event();
  CHECK(event.status == 0);
  CHECK(event.error == 0);
  CHECK(event.torque == 0);
  CHECK(event.fastening_time == 1000);
}

TEST_CASE("event numbers wrap") {
  catalogue::SimulationSpec facts = test::bm_start();
  test::append(facts.values, {"event.number", 65534});
  Bench bench({}, facts);
  std::vector<std::uint16_t> numbers;
  for (int i = 0; i < 3; ++i) {
    bench.write(alarm_reset, 1);
    numbers.push_back(bench.event().number);
  }
  CHECK(numbers == std::vector<std::uint16_t>{65535, 0, 1});
}

TEST_CASE("screws are counted down, and a new batch follows") {
  Bench bench;
  std::vector<std::uint16_t> left;
  for (int i = 0; i < 3; ++i) {
    bench.write(start, 1);
    bench.wait(1200ms);
    left.push_back(bench.event().screw_count);
  }
  CHECK(left == std::vector<std::uint16_t>{1, 2, 1});
}

TEST_CASE("auto output expires unless it is armed again, for each client alone") {
  struct Row {
    std::string name;
    Duration rearmed_after;
    Duration event_after;
    std::size_t pushed;
  };
  const std::vector<Row> rows = {
      {"in time", 0s, 9999ms, 1},
      {"just too late", 0s, 10s, 0},
      {"armed again", 5s, 14s, 1},
      {"armed again, too late", 5s, 15s, 0},
  };
  for (const Row& row : rows) {
    CAPTURE(row.name);
    Bench bench;
    bench.write(auto_output, 1);
    bench.wait(row.rearmed_after);
    bench.write(auto_output, 1);
    bench.wait(row.event_after - row.rearmed_after);
    bench.tool->raise_alarm(1, 7, bench.clock.now());
    CHECK(bench.pushed(other_client).empty());
    CHECK(bench.pushed().size() == row.pushed);
  }
}

TEST_CASE("who is told: armed, disarmed, gone, and those who were not asked for") {
  Bench bench;
  bench.write(auto_output, 1);
  bench.write(auto_output, 1, other_client);
  bench.write(alarm_reset, 1);
  CHECK(bench.pushed(other_client).size() == 1);
  CHECK(bench.tool->take_pushes().size() == 1);  // the other's was taken already

  bench.write(auto_output, 0);
  bench.write(alarm_reset, 1);
  CHECK(bench.pushed().empty());
  CHECK(bench.pushed(other_client).size() == 1);

  bench.write(alarm_reset, 1);
  bench.tool->disconnected(other_client);
  bench.write(alarm_reset, 1);
  CHECK(bench.tool->take_pushes().empty());
}

TEST_CASE("operators") {
  Bench bench;
  bench.tool->operator_rundown(Rundown::ng, bench.clock.now());
  CHECK(bench.tool->next_change() == start_time + 1100ms);  // while the torque rises
  bench.wait(1200ms);
  CHECK(bench.event().status == 2);
  CHECK(bench.event().error == 333);
  CHECK(bench.event().torque > 0);
  CHECK(bench.event().torque < 271);
  bench.tool->operator_rundown(Rundown::ok, bench.clock.now());
  bench.wait(1200ms);
  CHECK(bench.event().status == 1);
}

TEST_CASE("an operator at work pulls the trigger regularly") {
  Bench bench({.rundown_every = 5s, .ng_every = 3});
  bench.tool->advance(bench.clock.now());
  CHECK(bench.tool->next_change() == start_time + 5s);
  std::vector<std::uint16_t> results;
  bench.wait(2s);
  for (int i = 0; i < 4; ++i) {
    bench.wait(5s);
    CHECK(bench.event().number == 1962 + i);
    results.push_back(bench.event().status);
  }
  CHECK(results == std::vector<std::uint16_t>{1, 1, 2, 1});
}

TEST_CASE("a burst brings several results at once, each with its number") {
  Bench bench({.rundown_every = 5s, .burst = 3});
  bench.tool->advance(bench.clock.now());
  bench.write(auto_output, 1);
  bench.wait(7s);
  CHECK(bench.event().number == 1961 + 3);
  const auto pushes = bench.tool->take_pushes();
  REQUIRE(pushes.size() == 3);
  for (std::size_t i = 0; i < pushes.size(); ++i) {
    CHECK(modbus::registers_of(pushes[i].pdu).front() == 1962 + i);
  }
}

TEST_CASE("a reboot forgets motion, alarm, lock and output, and keeps parameters") {
  Bench bench;
  bench.write(2, 300);
  bench.write(auto_output, 1);
  bench.write(lock, 1);
  bench.tool->raise_alarm(1, 110, bench.clock.now());
  bench.tool->reboot(bench.clock.now());
  CHECK(bench.event().number == 0);
  CHECK(bench.status().alarm == 0);
  CHECK(bench.status().ready == 1);
  CHECK(bench.holding(2) == 300);
  bench.write(alarm_reset, 1);
  CHECK(bench.event().number == 1);
  CHECK(bench.tool->take_pushes().empty());
}

TEST_CASE("writes that the tool only pretends to do") {
  Bench ignoring({.faults = {*parse_fault("ignore-write@2")}});
  for (const std::uint16_t value : Registers{300, 301, 302}) {
    ignoring.write(2, value);
    CHECK(ignoring.holding(2) == (value == 301 ? 300 : value));
  }

  Bench deaf({.faults = {*parse_fault("ignore-write")}});
  deaf.write(start, 1);
  CHECK(deaf.status().running == 0);

  Bench other({.faults = {*parse_fault("store-other=5@every:2")}});
  other.write(2, 300);
  CHECK(other.holding(2) == 300);
  CHECK(other.refusal(modbus::write_request({2}, 601)) == 0x0E);  // does not count
  other.write(2, 310);
  CHECK(other.holding(2) == 315);
}

TEST_CASE("the frame that would be pushed is a read of the event block") {
  Bench bench;
  const auto frame = bench.tool->event_frame();
  REQUIRE(frame.has_value());
  CHECK(*frame == bench.ask(modbus::read_request(RegisterTable::input, {3200}, 14)));
}

TEST_CASE("the shipped profiles make tools that answer for all they name") {
  const files::ProfileStore store({std::string(SPINDLE_SOURCE_DIR) + "/profiles"},
                                  posix::source_disk());
  for (const std::string id : {"doga-bm", "doga-bmt"}) {
    CAPTURE(id);
    const auto profile = store.load(id);
    const auto facts = store.load_simulation(id);
    REQUIRE(profile.has_value());
    REQUIRE(facts.has_value());
    const auto tool = make_simulated_bus(*profile, *facts, {});
    const auto ask = [&tool](const Pdu& request, TimePoint now) {
      return tool->answer(client, {0}, request, now).value();
    };
    for (const catalogue::Parameter& parameter : profile->parameters) {
      if (profile->events->form_of(parameter) != nullptr) continue;  // of firmware 3000 and later
      CAPTURE(parameter.name);
      const Pdu request = modbus::read_request(parameter.table, parameter.address,
                                               catalogue::register_count(parameter.encoding));
      CHECK(modbus::fit(request, ask(request, start_time)) == modbus::Fit::answer);
    }
    const catalogue::Action begin = profile->find_action("start").value();
    ask(modbus::write_request(begin.address, begin.value.value()), start_time);
    REQUIRE(tool->next_change().has_value());
    const Duration duration = *tool->next_change() - start_time;
    CHECK(duration > 1s);
    CHECK(duration < 1500ms);

    const catalogue::Parameter kind = profile->find(profile->events->kind).value();
    const Pdu request = modbus::read_request(kind.table, kind.address, 1);
    const Pdu response = ask(request, start_time + duration);
    CHECK(profile->events->kinds.at(modbus::registers_of(response).front()) ==
          catalogue::EventKind::fastening_ok);
  }
}

TEST_CASE("from firmware 3000 on an event has four more torques and a barcode") {
  for (const auto& [firmware, size] : {std::pair{2999, 28}, std::pair{3000, 100}}) {
    CAPTURE(firmware);
    test::DeviceRig rig(test::product("doga-bm"),
                        {.firmware = static_cast<std::uint16_t>(firmware)});
    rig.tool->connected(client);
    const auto ask = [&](std::uint16_t address, std::uint16_t value) {
      rig.tool->answer(client, {0}, modbus::write_request({address}, value), rig.clock.now());
    };
    ask(auto_output, 1);
    ask(start, 1);
    rig.wait(5s);
    const auto pushes = rig.tool->take_pushes(client);
    REQUIRE(pushes.size() == 1);
    const Bytes& data = pushes.front().pdu.data;
    REQUIRE(data.size() == static_cast<std::size_t>(size) + 1);
    CHECK(data.front() == size);
    if (size == 100) CHECK(std::string(data.begin() + 1 + 36, data.begin() + 1 + 43) == "WO-1234");
  }
}
