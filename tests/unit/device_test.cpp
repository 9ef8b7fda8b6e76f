#include "spindle/device/device.hpp"

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <string>
#include <variant>
#include <vector>

#include "support/rig.hpp"
#include "support/scripted_device.hpp"

using namespace spindle;
using namespace spindle::device;
using namespace std::chrono_literals;
using catalogue::Parameter;
using catalogue::Profile;
using catalogue::Value;
using modbus::FunctionCode;
using modbus::Pdu;

namespace {

const test::Product& bm_product() {
  static const test::Product product = test::product("doga-bm");
  return product;
}

const Profile& bm() { return bm_product().profile; }

struct Setup {
  std::vector<std::string> faults = {};
  sim::DeviceOptions tool = {};
  unsigned lost_writes = 0;  ///< the first so many never come to the tool
  std::string shown = {};
};

/// A device before a simulated tool, with no retries of reads.
struct Bench : test::BmRig {
  explicit Bench(const Setup& setup = {}, const Profile& seen_as = bm())
      : BmRig(bm_product(), with_faults(setup)) {
    profile = seen_as;
    faults = test::plan_of(setup.faults);
    endpoint = link::parse_endpoint("tcp://192.168.10.23:5000").value();
    options = {.retries = 0, .shown = setup.shown};
    wire.fate = test::next_meet(test::Fate::is_lost, setup.lost_writes, [](const Pdu& request) {
      return request.function == static_cast<std::uint8_t>(FunctionCode::write_single_register);
    });
    opened = connect();
    REQUIRE(opened.has_value());
  }

  static sim::DeviceOptions with_faults(const Setup& setup) {
    sim::DeviceOptions how = setup.tool;
    how.faults = test::plan_of(setup.faults);
    return how;
  }

  Device& device() { return *opened; }
  [[nodiscard]] std::size_t count(FunctionCode function) const { return wire.count(function); }
  [[nodiscard]] std::size_t writes() const { return count(FunctionCode::write_single_register); }

  Result<Device> opened = tl::unexpected(Error());
};

const Value before{Decimal(271, -2), {}};
const Value wanted{Decimal(300, -2), {}};

Parameter target_torque() { return bm().find("preset.1.target-torque").value(); }

Written write(Bench& bench) { return bench.device().write(target_torque(), before, wanted); }

Result<ActionResult> perform(Bench& bench, std::string_view action, std::uint16_t value) {
  return bench.device().perform(bm().find_action(action).value(), value);
}

}  // namespace

TEST_CASE("a tool is of the profile only when it says so itself") {
  struct Case {
    std::string what;
    Setup setup;
    std::optional<Errc> refused;
  };
  const std::vector<Case> cases = {
      {"the profile's own", {}, std::nullopt},
      {"a longer identity", {.tool = {.identity_bytes = 13}}, std::nullopt},
      {"the longest identity", {.tool = {.identity_bytes = 17}}, std::nullopt},
      {"the last firmware of the generation", {.tool = {.firmware = 3999}}, std::nullopt},
      {"the next generation", {.tool = {.firmware = 4000}}, Errc::wrong_generation},
      {"a later one", {.tool = {.firmware = 4001}}, Errc::wrong_generation},
      {"an unknown model", {.tool = {.tool_model = 99}}, Errc::wrong_generation},
      {"an identity that is too short", {.tool = {.identity_bytes = 8}}, Errc::wrong_generation},
      {"a refusal to say", {.faults = {"exception=1"}}, Errc::wrong_generation},
      {"silence", {.faults = {"lost"}}, Errc::no_answer},
      {"a hang-up", {.faults = {"close"}}, Errc::closed},
  };
  for (const Case& row : cases) {
    CAPTURE(row.what);
    Bench bench(row.setup);
    const auto known = bench.device().require_known_registers();
    CHECK(known.has_value() == !row.refused.has_value());
    if (!known) CHECK(known.error().code == row.refused);
    CHECK(bench.wire.requests.size() == 1);
  }
}

TEST_CASE("a tool is asked what it is once, and not at all where the profile has no identity") {
  Bench bench;
  REQUIRE(bench.device().require_known_registers().has_value());
  REQUIRE(bench.device().require_known_registers().has_value());
  CHECK(bench.count(FunctionCode::report_server_id) == 1);

  Profile anonymous = bm();
  anonymous.identity.reset();
  Bench unasked({}, anonymous);
  CHECK(unasked.device().require_known_registers().has_value());
  CHECK(unasked.wire.requests.empty());
}

TEST_CASE("a refusal names firmware and profile, and what can still be done") {
  Bench bench({.tool = {.firmware = 4001}});
  const auto known = bench.device().require_known_registers();
  REQUIRE_FALSE(known.has_value());
  CHECK(describe(known.error()) ==
        "tcp://192.168.10.23:5000: firmware 4001 has other registers than profile doga-bm (below "
        "4000); only raw registers such as @holding:2 can be read");
}

TEST_CASE("all presets are read in at most four requests") {
  Bench bench;
  const auto presets = bm().select({"preset.*"});
  REQUIRE(presets->size() == 225);
  const auto readings = bench.device().read_each(*presets, Limits::skip);
  REQUIRE(readings.has_value());
  CHECK(readings->size() == 225);
  CHECK(bench.wire.requests.size() <= 4);
  CHECK((*readings)[1].value->to_string() == "2.71");
}

TEST_CASE("a hole stands in its own reading, and the limits of a parameter beside its value") {
  Bench bench;
  const auto parameters = bm().select({"preset.1.target-torque", "p564", "p725", "status.ready"});
  const auto readings = bench.device().read_each(*parameters, Limits::read);
  REQUIRE(readings.has_value());
  const Reading& torque = (*readings)[0];
  CHECK(torque.minimum->to_string() == "0.00");
  CHECK(torque.maximum->to_string() == "6.00");
  CHECK_FALSE(torque.limits_error.has_value());

  const Reading& hole = (*readings)[1];
  REQUIRE_FALSE(hole.value.has_value());
  CHECK(hole.value.error().code == Errc::exception_response);
  CHECK(hole.value.error().name == "p564");
  CHECK_FALSE(hole.limits_error.has_value());  // what is not there has no limits

  for (const std::size_t without : {2U, 3U}) {
    CAPTURE(without);
    CHECK((*readings)[without].value.has_value());
    CHECK_FALSE((*readings)[without].minimum.has_value());
    CHECK_FALSE((*readings)[without].limits_error.has_value());
  }
}

TEST_CASE("a write is sent once and proven by reading back") {
  struct Case {
    std::string what;
    Setup setup;
    WriteResult result;
    std::string now;
    std::size_t writes;
  };
  const std::vector<Case> cases = {
      {"acknowledged", {}, WriteResult::written, "3.00", 1},
      {"acknowledged with a wrong echo",
       {.faults = {"wrong-echo@1"}},
       WriteResult::written,
       "3.00",
       1},
      {"taken, but the answer was lost", {.faults = {"lost@1"}}, WriteResult::written, "3.00", 1},
      {"never arrived: repeated", {.lost_writes = 1}, WriteResult::written, "3.00", 2},
      {"acknowledged, not stored", {.faults = {"ignore-write"}}, WriteResult::mismatch, "2.71", 1},
      {"stored as something else", {.faults = {"store-other=5"}}, WriteResult::coerced, "3.05", 1},
  };
  for (const Case& row : cases) {
    CAPTURE(row.what);
    Bench bench(row.setup);
    const auto written = write(bench);
    CHECK(written.result == row.result);
    CHECK(written.error.has_value() == (row.result != WriteResult::written));
    REQUIRE(written.now.has_value());
    CHECK(written.now->to_string() == row.now);
    CHECK(bench.writes() == row.writes);
  }
}

TEST_CASE("a write that fails says what is known, and is not repeated blindly") {
  struct Case {
    std::string what;
    Setup setup;
    Errc code;
    std::string text;  ///< part of the description
    std::size_t writes;
    std::size_t reads;
  };
  const std::vector<Case> cases = {
      {"refused",
       {.faults = {"exception=14@1"}},
       Errc::exception_response,
       "refused 'write register 2' with exception 0E",
       1,
       0},
      {"hung up",
       {.faults = {"close@1"}},
       Errc::closed,
       "whether it was written is not known: it holds 2.71 or 3.00",
       1,
       0},  // the reading finds the connection closed
      {"never arrives, twice",
       {.lost_writes = 99},
       Errc::no_answer,
       "no answer to 'write register 2' within 1s; it still holds 2.71",
       2,
       14},
      {"no answer, then a third value",
       {.faults = {"lost@1", "store-other=5"}},
       Errc::no_answer,
       "no answer to 'write register 2' within 1s; it now holds 3.05",
       1,
       7},
      {"no answer, and none to the reading",
       {.faults = {"lost"}},
       Errc::no_answer,
       "whether it was written is not known: it holds 2.71 or 3.00; read it again",
       1,
       1},
      {"acknowledged, reading refused",
       {.faults = {"exception=2@2"}},
       Errc::mismatch,
       "the tool acknowledged it, but reading it back failed",
       1,
       1},
      {"acknowledged, reading not answered",
       {.faults = {"lost@2"}},
       Errc::no_answer,
       "the tool acknowledged it, but reading it back failed",
       1,
       1},
  };
  for (const Case& row : cases) {
    CAPTURE(row.what);
    Bench bench(row.setup);
    const auto written = write(bench);
    REQUIRE(written.error.has_value());
    const std::string text = describe(*written.error);
    CAPTURE(text);
    CHECK(written.error->code == row.code);
    CHECK(text.find(row.text) != std::string::npos);
    CHECK(written.error->name == "preset.1.target-torque");
    CHECK(bench.writes() == row.writes);
    CHECK(bench.count(FunctionCode::read_holding_registers) == row.reads);
  }
}

TEST_CASE("an action is sent exactly once, however it ends") {
  struct Case {
    std::string what;
    std::string action;
    std::uint16_t value;
    Setup setup;
    ActionResult result;
  };
  const std::vector<Case> cases = {
      {"its effect is read", "select-preset", 3, {}, ActionResult::confirmed},
      {"nothing can prove it", "auto-output", 1, {}, ActionResult::sent},
      {"a fixed reading proves it", "alarm-reset", 1, {}, ActionResult::confirmed},
      {"the answer is lost, and its effect is read",
       "select-preset",
       3,
       {.faults = {"lost@1"}},
       ActionResult::confirmed},
      {"an echo is not a deed",
       "select-preset",
       3,
       {.faults = {"ignore-write"}},
       ActionResult::not_confirmed},
  };
  for (const Case& row : cases) {
    CAPTURE(row.what);
    Bench bench(row.setup);
    const auto result = perform(bench, row.action, row.value);
    REQUIRE(result.has_value());
    CHECK(*result == row.result);
    CHECK(bench.writes() == 1);
  }
}

TEST_CASE("an action that fails was sent once all the same") {
  struct Case {
    std::string what;
    Setup setup;
    Errc code;
  };
  const std::vector<Case> cases = {
      {"the request is lost", {.lost_writes = 99}, Errc::no_answer},
      {"it is refused", {.faults = {"exception=2@1"}}, Errc::exception_response},
      {"the connection ends", {.faults = {"close@1"}}, Errc::closed},
      {"the proof is refused", {.faults = {"exception=2@2"}}, Errc::mismatch},
      {"the proof does not come", {.faults = {"lost@2"}}, Errc::no_answer},
  };
  for (const Case& row : cases) {
    CAPTURE(row.what);
    Bench bench(row.setup);
    const auto result = perform(bench, "select-preset", 3);
    REQUIRE_FALSE(result.has_value());
    CHECK(result.error().code == row.code);
    CHECK(result.error().name == "select-preset");
    CHECK(bench.writes() == 1);
  }
}

TEST_CASE("a proof is awaited for one answer time, and not longer") {
  Bench bench({.faults = {"ignore-write"}});
  const TimePoint start = bench.clock.now();
  REQUIRE(perform(bench, "select-preset", 3) == ActionResult::not_confirmed);
  const Duration waited = bench.clock.now() - start;
  CHECK(waited > 900ms);
  CHECK(waited <= 1s);
  CHECK(bench.count(FunctionCode::read_input_registers) > 10);
}

TEST_CASE("an interrupt ends the wait for a proof as an interrupt") {
  Bench bench({.faults = {"ignore-write"}});
  bench.clock.at(bench.clock.now() + 100ms, [&] { bench.interrupt.raise(2); });
  const auto result = perform(bench, "select-preset", 3);
  REQUIRE_FALSE(result.has_value());
  CHECK(result.error().code == Errc::interrupted);
}

TEST_CASE("errors name the tool, its address, and the maker's words for an exception") {
  Bench bench({.faults = {"exception=14@1"}, .shown = "station3"});
  const auto written = write(bench);
  REQUIRE(written.error.has_value());
  CHECK(written.error->target == "station3");
  CHECK(written.error->endpoint == "tcp://192.168.10.23:5000");
  CHECK(written.error->exception == 0x0E);
  CHECK(describe(*written.error) ==
        "station3 (tcp://192.168.10.23:5000): preset.1.target-torque: the tool refused 'write "
        "register 2' with exception 0E (range of data not available: the value is outside the "
        "tool's limits)");
}

TEST_CASE("a line that cannot be opened is told with the tool's name and address") {
  test::ScriptedDevice peer;
  peer.refusal = Errc::no_route;
  const auto device = peer.open("tcp://192.168.10.23:5000", bm(), {.shown = "station3"});
  REQUIRE_FALSE(device.has_value());
  CHECK(device.error().target == "station3");
  CHECK(device.error().endpoint == "tcp://192.168.10.23:5000");
}

TEST_CASE("timeouts come from the user, else from the profile") {
  for (const auto& [given, expected] :
       {std::pair<std::optional<Duration>, Duration>{std::nullopt, 1s}, {250ms, 250ms}}) {
    test::ScriptedDevice peer;
    auto device = peer.open("tcp://192.168.10.23:5000", bm(),
                            {.answer_timeout = given, .connect_timeout = given, .retries = 0});
    REQUIRE(device.has_value());
    CHECK(peer.connect_timeout == given.value_or(bm().link.connect));
    CHECK_FALSE(device->report_server_id().has_value());
    CHECK(peer.clock.now() - test::FakeClock::start == expected);
  }
}

TEST_CASE("a ping touches no value, and an exception answers it, too") {
  for (const std::vector<std::string>& faults :
       {std::vector<std::string>{}, std::vector<std::string>{"exception=1"}}) {
    Bench bench({.faults = faults});
    CHECK(bench.device().ping() == 100us);
    CHECK(bench.wire.requests.size() == 1);
    CHECK(bench.count(FunctionCode::report_server_id) == 1);
  }
  Bench silent({.faults = {"lost"}});
  CHECK(silent.device().ping().error().code == Errc::no_answer);
}

TEST_CASE("the whole last event is read without a frame that looks like a pushed one") {
  Bench bench;
  const auto event = bench.device().last_event();
  REQUIRE(event.has_value());
  REQUIRE(event->has_value());
  CHECK((*event)->size() == 14);
  CHECK((*event)->front() == 1961);
  CHECK((*event)->back() == 402);
  for (const auto& [at, request] : bench.wire.requests) CHECK(get_u16(request.data, 2) != 14);
}

// ---- what a connection believes ----

namespace {

/// A device of holding and input registers in which N has the value N, on any profile.
struct Opened : test::ScriptedDevice {
  explicit Opened(Profile seen_as, const LinkOptions& options = {}) : profile(std::move(seen_as)) {
    script.otherwise = [](ByteView request) {
      const Pdu pdu = test::request_of(modbus::Framing::tcp, request).pdu;
      const auto parsed = modbus::parse_request(pdu).value();
      const auto& read = std::get<modbus::ReadRequest>(parsed);
      Registers registers;
      for (std::uint16_t at = 0; at < read.count; ++at) {
        registers.push_back(static_cast<std::uint16_t>(read.first.value + at));
      }
      return std::vector<test::Arrival>{
          {Duration(1ms), test::response_to(modbus::Framing::tcp, request,
                                            modbus::read_response(read.table, registers))}};
    };
    device = open("tcp://192.168.10.23", profile, options);
    REQUIRE(device.has_value());
  }

  const Profile profile;
  Result<Device> device = tl::unexpected(Error());
};

Parameter input_register(std::uint16_t address) {
  Parameter parameter;
  parameter.name = fmt::format("@input:{}", address);
  parameter.table = modbus::RegisterTable::input;
  parameter.address = {address};
  return parameter;
}

}  // namespace

TEST_CASE("without a profile nothing is asked whose answer could be a frame that is sent unasked") {
  std::vector<Parameter> block;
  for (std::uint16_t at = 3300; at < 3314; ++at) block.push_back(input_register(at));
  const auto requests_for = [&](const LinkOptions& options) {
    Opened opened(Profile(), options);
    const auto readings = opened.device->read_each(block, Limits::skip);
    REQUIRE(readings.has_value());
    for (const Reading& reading : *readings) {
      CHECK(reading.registers == Registers{reading.parameter.address.value});
    }
    std::vector<std::uint16_t> counts;
    for (const test::Sent& sent : opened.script.sent) counts.push_back(get_u16(sent.bytes, 10));
    return counts;
  };
  CHECK(requests_for({}) == std::vector<std::uint16_t>{14});
  CHECK(requests_for({.unasked = shapes_of(*bm().events)}) == std::vector<std::uint16_t>{13, 1});
}

TEST_CASE("the event block is read in the longest form that a tool with this firmware has") {
  const auto counts_of = [](Bench& bench) {
    std::vector<std::uint16_t> counts;
    for (const auto& request : bench.wire.requests) {
      const auto parsed = modbus::parse_request(request.pdu);
      const auto* read = parsed ? std::get_if<modbus::ReadRequest>(&*parsed) : nullptr;
      if (read != nullptr) counts.push_back(read->count);
    }
    return counts;
  };
  Bench later({.tool = {.firmware = 3000}});
  REQUIRE(later.device().require_known_registers());
  const auto block = later.device().event_block();
  REQUIRE(block);
  CHECK(block->size() == 50);
  Bench older({.tool = {.firmware = 2999}});
  REQUIRE(older.device().require_known_registers());
  CHECK(older.device().event_block().value().size() == 14);
  CHECK(counts_of(older) == std::vector<std::uint16_t>{13, 1});
  // 50 at once would look like an event.
  CHECK(counts_of(later) == std::vector<std::uint16_t>{49, 1});
}

TEST_CASE("where more is refused, the usual event block is read from then on") {
  Bench bench({.faults = {"exception=2@2"}, .tool = {.firmware = 3100}});
  REQUIRE(bench.device().require_known_registers());
  CHECK(bench.device().event_block().value().size() == 14);
  CHECK(bench.device().event_block().value().size() == 14);
}

TEST_CASE("the first id of a connection is not known before, and never small") {
  std::set<std::uint16_t> ids;
  for (const Duration later : {Duration(0), Duration(1), Duration(4711), Duration(1s + 17ns)}) {
    test::ScriptedDevice peer;
    peer.clock.advance(later);
    auto device = peer.open("tcp://192.168.10.23", bm());
    ids.insert(device->session().options().first_transaction);
  }
  CHECK(ids.size() == 4);
  CHECK(*ids.begin() >= 0x8000);
}

TEST_CASE("whose answers are taken is the profile's") {
  Profile known;
  known.id = "known";
  CHECK(Opened(Profile()).device->session().options().rules.units == link::Units::identified);
  CHECK(Opened(known).device->session().options().rules.units == link::Units::asked);
  CHECK(Opened(bm()).device->session().options().rules.units == link::Units::any);
}

// ---- serial lines ----

namespace {

Profile drive() {
  Profile profile;
  profile.id = "drive";
  profile.link.framing = modbus::Framing::rtu;
  profile.link.unit = 1;
  profile.link.loopback = true;
  profile.link.serial = {
      .line = {.baud = 19200}, .gaps = {{19200, 5500us}, {0, 3500us}}, .broadcast_pause = 5ms};
  return profile;
}

link::SessionOptions options_for(const std::string& url, const Profile& profile) {
  test::ScriptedDevice peer;
  auto device = peer.open(url, profile).value();
  device.use(profile, {});  // as after an identification: it must not change the framing
  return device.session().options();
}

}  // namespace

TEST_CASE("how a line is talked on follows the address, and the profile where it says nothing") {
  struct Row {
    std::string url;
    modbus::Framing framing;
    std::uint8_t unit;
    Duration gap;
    Duration broadcast_gap;
    Duration character;
    link::LocalEcho echo;
  };
  using enum modbus::Framing;
  using link::LocalEcho;
  const Duration at_9600 = 1145833ns;
  const Duration at_19200 = 572916ns;
  const Duration at_115200 = 95486ns;
  for (const Row& row : {
           Row{"rtu:///d", rtu, 1, 5500us, 10500us, at_19200, LocalEcho::automatic},
           Row{"rtu:///d?unit=7&baud=9600&echo=true", rtu, 7, 5500us, 10500us, at_9600,
               LocalEcho::present},
           Row{"rtu:///d?baud=115200&echo=false", rtu, 1, 3500us, 8500us, at_115200,
               LocalEcho::absent},
           Row{"rtu:///d?baud=115200&gap=20ms", rtu, 1, 20ms, 25ms, at_115200,
               LocalEcho::automatic},
           Row{"rtu:///d?gap=0ms", rtu, 1, 0ms, 5ms, at_19200, LocalEcho::automatic},
           Row{"rtu+tcp://h:1?unit=3", rtu, 3, 5500us, 10500us, at_19200, LocalEcho::automatic},
           Row{"rtu+tcp://h:1?baud=115200", rtu, 1, 3500us, 8500us, at_115200,
               LocalEcho::automatic},
           Row{"sim:drive", rtu, 1, 5500us, 10500us, at_19200, LocalEcho::absent},
           Row{"tcp://h?unit=4", tcp, 4, 0ms, 0ms, 0ms, LocalEcho::automatic},
       }) {
    CAPTURE(row.url);
    const auto options = options_for(row.url, drive());
    CHECK(options.rules.framing == row.framing);
    CHECK(options.unit.value == row.unit);
    CHECK(options.gap == row.gap);
    CHECK(options.broadcast_gap == row.broadcast_gap);
    CHECK(options.character_time == row.character);
    CHECK(options.echo == row.echo);
    CHECK(options.in_use_until == (row.framing == rtu ? test::FakeClock::start : TimePoint()));
  }
  // A profile without rules: three times the standard's silence.
  const auto unknown = options_for("rtu:///d?baud=115200", Profile());
  CHECK(unknown.gap == 5250us);
  CHECK(options_for("rtu:///d", Profile()).gap == 3 * 4010416ns);
}

TEST_CASE("a broadcast goes where a write goes, by the same functions") {
  test::ScriptedDevice peer;
  Profile profile = drive();
  profile.link.write_function = 16;
  auto device = peer.open("rtu:///d?unit=0", profile).value();
  device.use(profile, {});
  catalogue::Parameter lamp;
  lamp.name = "lamp";
  lamp.table = modbus::RegisterTable::coil;
  lamp.address = {5};
  lamp.encoding.kind = catalogue::Kind::bit;
  catalogue::Parameter speed;
  speed.name = "speed";
  speed.address = {92};
  speed.write_address = modbus::RegisterAddress{93};
  REQUIRE(device.broadcast(lamp, {Decimal(1)}));
  REQUIRE(device.broadcast(speed, {Decimal(7)}));
  REQUIRE(peer.script.sent.size() == 2);
  const auto without_checksum = [](const Bytes& bytes) {
    return Bytes(bytes.begin(), bytes.end() - 2);
  };
  CHECK(without_checksum(peer.script.sent[0].bytes) == Bytes{0, 0x05, 0, 5, 0xFF, 0});
  CHECK(without_checksum(peer.script.sent[1].bytes) == Bytes{0, 0x10, 0, 93, 0, 1, 2, 0, 7});
}
