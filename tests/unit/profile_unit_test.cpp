#include <doctest/doctest.h>

#include <optional>
#include <string>
#include <vector>

#include "spindle/sim/simulated_tool.hpp"
#include "support/rig.hpp"

using namespace spindle;
using namespace std::chrono_literals;
using catalogue::EventKind;
using catalogue::Kind;
using modbus::RegisterTable;

namespace {

/// A simulated tool of a profile that the program does not ship.
struct Simulated : test::DeviceRig {
  explicit Simulated(const std::string& name, const sim::DeviceOptions& how = {})
      : Rig(test::product(name), how) {}
  explicit Simulated(const test::Product& product) : Rig(product, sim::DeviceOptions()) {}

  /// Empty: refused.
  std::optional<Registers> read(RegisterTable table, std::uint16_t first, std::uint16_t count = 1) {
    const modbus::Pdu response = ask(modbus::read_request(table, {first}, count)).value();
    if (modbus::exception_of(response)) return std::nullopt;
    return modbus::registers_of(modbus::read_request(table, {first}, count), response);
  }
  std::optional<std::uint8_t> write(std::uint16_t address, std::uint16_t value) {
    return refused(modbus::write_request({address}, value));
  }
  std::optional<std::uint8_t> refused(const modbus::Pdu& request) {
    return modbus::exception_of(ask(request).value());
  }
};

catalogue::Parameter parameter(catalogue::Text name, RegisterTable table, std::uint16_t address,
                               const catalogue::Encoding& encoding = {}) {
  catalogue::Parameter made;
  made.name = std::move(name);
  made.table = table;
  made.address = {address};
  made.encoding = encoding;
  if (modbus::is_writable(table)) made.access = catalogue::Access::read_write;
  return made;
}

catalogue::Action action(catalogue::Text name, RegisterTable table, std::uint16_t address) {
  catalogue::Action made;
  made.name = std::move(name);
  made.table = table;
  made.address = {address};
  if (table == RegisterTable::coil) made.encoding.kind = Kind::bit;
  made.value = 1;
  return made;
}

/// A device that is run by coils, and tells of itself by discrete inputs.
test::Product gate() {
  test::Product product;
  catalogue::Profile& gate = product.profile;
  gate.id = "gate";
  gate.link.max_read_bits = 16;
  gate.link.max_write = 4;
  const catalogue::Encoding bit = {.kind = Kind::bit};
  auto flag = parameter("new", RegisterTable::discrete, 3, bit);
  flag.reading = catalogue::Reading::consumes;
  gate.parameters = {parameter("lamp", RegisterTable::coil, 10, bit),
                     parameter("lamps", RegisterTable::coil, 20, {.kind = Kind::bit, .count = 4}),
                     parameter("runs", RegisterTable::discrete, 2, bit),
                     flag,
                     parameter("result", RegisterTable::input, 0),
                     parameter("fault", RegisterTable::input, 1)};
  auto start = action("start", RegisterTable::coil, 0);
  start.stop_value = 0;
  start.confirm = "runs";
  auto clear = action("clear", RegisterTable::coil, 1);
  gate.actions = {start, clear};
  gate.alarm_reset = "clear";
  gate.run = catalogue::RunSpec{catalogue::StartActionSpec{.start = "start", .alarm = "fault"}};
  gate.events = catalogue::EventSpec{
      .model = catalogue::EventModel::flag,
      .function = 4,
      .first = 0,
      .count = 2,
      .number = {},
      .flag = "new",
      .kind = "result",
      .kinds = {{1, EventKind::fastening_ok}, {2, EventKind::fastening_ng}, {3, EventKind::error}}};
  return product;
}

/// A device with nothing but these parameters.
test::Product bare(std::vector<catalogue::Parameter> parameters) {
  test::Product product;
  product.profile.id = "bare";
  product.profile.link.max_write = 16;
  product.profile.parameters = std::move(parameters);
  return product;
}

}  // namespace

TEST_CASE("a flag is cleared by whatever reads it, and set by the next result") {
  Simulated device("kducer");
  CHECK(device.read(RegisterTable::input, 294) == Registers{0});
  device.tool->happen(EventKind::fastening_ok, device.clock.now());
  CHECK(device.read(RegisterTable::input, 295, 67).has_value());
  CHECK(device.read(RegisterTable::input, 294) == Registers{1});
  CHECK(device.read(RegisterTable::input, 294) == Registers{0});
  device.tool->happen(EventKind::fastening_ok, device.clock.now());
  CHECK(device.read(RegisterTable::input, 290, 10) == std::nullopt);
  CHECK(device.read(RegisterTable::input, 294, 4)->front() == 1);
  CHECK(device.read(RegisterTable::input, 294) == Registers{0});
}

TEST_CASE("what events say is given in turn, by kind") {
  Simulated device("kducer");
  std::vector<std::uint16_t> torques;
  for (const EventKind kind : {EventKind::fastening_ok, EventKind::fastening_ok,
                               EventKind::fastening_ng, EventKind::fastening_ok}) {
    device.tool->happen(kind, device.clock.now());
    torques.push_back(device.read(RegisterTable::input, 318)->front());
  }
  CHECK(torques == std::vector<std::uint16_t>{152, 149, 88, 152});
  CHECK(device.read(RegisterTable::input, 303) == Registers{1});
}

TEST_CASE("results come by themselves, and every so many are NG") {
  Simulated device("countermatic", {.rundown_every = 2s, .ng_every = 2});
  device.tool->advance(device.clock.now());
  device.clock.advance(6s);
  CHECK(device.read(RegisterTable::holding, 1000, 2) == Registers{3, 1});
  CHECK(device.tool->take_pushes().empty());
  device.clock.advance(2s);
  CHECK(device.read(RegisterTable::holding, 1000, 5) == Registers{4, 2, 0xFFFE, 0xEE8F, 7});
}

TEST_CASE("parameters are stored, and what does not exist or is too long is refused") {
  Simulated device("countermatic");
  CHECK(device.read(RegisterTable::holding, 10) == Registers{500});
  CHECK(device.write(10, 450) == std::nullopt);
  CHECK(device.read(RegisterTable::holding, 10) == Registers{450});
  CHECK(device.write(11, 1) == 2);
  CHECK(device.write(1000, 1) == 2);
  CHECK(device.read(RegisterTable::holding, 1000, 21) == std::nullopt);
  CHECK(device.read(RegisterTable::input, 1000) == std::nullopt);
  CHECK(modbus::exception_of(device.ask(modbus::report_server_id_request()).value()) == 1);
}

TEST_CASE("an alarm shows, and the action that resets it shows, too") {
  Simulated device("countermatic", {.alarms = {{.code = 7, .after = 1s}}});
  device.tool->advance(device.clock.now());
  device.clock.advance(1s);
  CHECK(device.read(RegisterTable::holding, 20) == Registers{7});
  CHECK(device.read(RegisterTable::holding, 1001) == Registers{3});
  CHECK(device.write(30, 1) == std::nullopt);
  CHECK(device.read(RegisterTable::holding, 20) == Registers{0});
}

TEST_CASE("faults of a tool are felt") {
  Simulated device("countermatic", {.faults = {sim::parse_fault("ignore-write@1").value()}});
  CHECK(device.write(10, 450) == std::nullopt);
  CHECK(device.read(RegisterTable::holding, 10) == Registers{500});
  CHECK(device.write(10, 450) == std::nullopt);
  CHECK(device.read(RegisterTable::holding, 10) == Registers{450});
}

TEST_CASE("a reboot counts from 0, and keeps what is stored") {
  Simulated device("countermatic");
  device.tool->happen(EventKind::fastening_ok, device.clock.now());
  device.write(10, 450);
  device.tool->reboot(device.clock.now());
  CHECK(device.read(RegisterTable::holding, 1000) == Registers{0});
  CHECK(device.read(RegisterTable::holding, 10) == Registers{450});
}

TEST_CASE("registers, events and a motor on a serial line need a profile only") {
  Simulated press("servo-press",
                  {.units = {3}, .rundown_every = 2s, .alarms = {{.code = 7, .after = 5s}}});
  press.tool->advance(press.clock.now());
  const auto ask = [&](const modbus::Pdu& request) { return press.ask(request, 3).value(); };
  const auto read = [&](std::uint16_t first) {
    return modbus::registers_of(ask(modbus::read_request(RegisterTable::holding, {first}, 1)))[0];
  };
  const auto write = [&](std::uint16_t first, const Registers& words) {
    return modbus::exception_of(ask(modbus::write_request({first}, RegisterView(words))));
  };
  CHECK_FALSE(press.ask(modbus::report_server_id_request(), 4).has_value());
  CHECK(modbus::server_id_of(ask(modbus::report_server_id_request())).size() == 3);
  CHECK(ask(modbus::loopback_request(7)) == modbus::loopback_request(7));
  CHECK(press.tool->required_gap() == 4ms);

  CHECK(write(0, {1, 900}) == std::nullopt);
  press.clock.advance(4s);
  CHECK(read(10) == 1);
  CHECK(read(11) == 900);
  CHECK(read(100) == 2);
  CHECK(read(102) == 42);

  press.clock.advance(1s);
  CHECK(read(12) == 7);
  CHECK(read(101) == 3);
  press.clock.advance(1s);
  CHECK(read(10) == 0);
  CHECK(write(0, {0}) == std::nullopt);
  CHECK(write(20, {1}) == std::nullopt);
  CHECK(read(12) == 0);
}

TEST_CASE("several registers are written all or none, and none behind the last address") {
  Simulated press("servo-press", {.units = {1}});
  CHECK(static_cast<test::DeviceRig&>(press).write(1, Registers{900, 0, 60'000}) == 3);
  CHECK(press.read(RegisterTable::holding, 1) == Registers{600});
  CHECK(static_cast<test::DeviceRig&>(press).write(1, Registers{900, 0, 50'000}) == 0);
  CHECK(press.read(RegisterTable::holding, 1, 3) == Registers{900, 0, 50'000});
  CHECK(static_cast<test::DeviceRig&>(press).write(65535, Registers{1, 1}) == 2);
}

TEST_CASE("an action shows until the value that ends it") {
  Simulated press("servo-press", {.units = {1}});
  CHECK(press.write(21, 1) == std::nullopt);
  CHECK(press.read(RegisterTable::holding, 13) == Registers{1});
  CHECK(press.write(21, 0) == std::nullopt);
  CHECK(press.read(RegisterTable::holding, 13) == Registers{0});
}

TEST_CASE("some alarms end only with the power, which keeps parameters and no command") {
  Simulated press("servo-press", {.units = {1}});
  press.write(0, 1);
  press.write(1, 900);
  press.tool->raise_alarm(1, 9, press.clock.now());
  press.write(20, 1);
  CHECK(press.read(RegisterTable::holding, 12) == Registers{9});
  press.tool->power_cycle(1, press.clock.now());
  CHECK(press.read(RegisterTable::holding, 12) == Registers{0});
  CHECK(press.read(RegisterTable::holding, 0, 2) == Registers{0, 900});
}

TEST_CASE("coils and discrete inputs are read and written by their own functions") {
  Simulated device(gate());
  const auto coil = RegisterTable::coil;
  CHECK(device.refused(modbus::write_coil_request({10}, 1)) == std::nullopt);
  CHECK(device.read(coil, 10) == Registers{1});
  CHECK(device.refused(modbus::write_coils_request({20}, Registers{1, 0, 1, 1})) == std::nullopt);
  CHECK(device.read(coil, 20, 4) == Registers{1, 0, 1, 1});
  CHECK(device.refused(modbus::write_coil_request({22}, 0)) == std::nullopt);
  CHECK(device.read(coil, 20, 4) == Registers{1, 0, 0, 1});
  CHECK(device.refused(modbus::write_coil_request({30}, 1)) == 2);
  CHECK(device.refused(modbus::read_request(coil, {0}, 17)) == 3);
  CHECK(device.refused(modbus::read_request(RegisterTable::discrete, {0}, 1)) == 2);
  CHECK(device.refused(modbus::read_request(RegisterTable::holding, {0}, 1)) == 1);
  CHECK(device.write(0, 1) == 1);
  Simulated press("servo-press");
  CHECK(press.refused(modbus::write_coil_request({0}, 1)) == 1);
  CHECK(press.refused(modbus::read_request(coil, {0}, 1)) == 1);
}

TEST_CASE("a run that an action starts ends by itself, or by its stop, and not with an alarm") {
  Simulated device(gate());
  const auto runs = [&] { return device.read(RegisterTable::discrete, 2) == Registers{1}; };
  const auto is_new = [&] { return device.read(RegisterTable::discrete, 3) == Registers{1}; };
  const auto start = [&](std::uint16_t value) {
    CHECK(device.refused(modbus::write_coil_request({0}, value)) == std::nullopt);
  };
  start(1);
  CHECK(runs());
  device.wait(3s);
  CHECK_FALSE(runs());
  CHECK(is_new());
  CHECK_FALSE(is_new());
  CHECK(device.read(RegisterTable::input, 0) == Registers{1});

  start(1);
  start(0);
  CHECK_FALSE(runs());
  CHECK(is_new());
  CHECK(device.read(RegisterTable::input, 0) == Registers{2});

  device.tool->raise_alarm(1, 5, device.clock.now());
  start(1);
  CHECK_FALSE(runs());
  CHECK(device.refused(modbus::write_coil_request({1}, 1)) == std::nullopt);
  CHECK(device.read(RegisterTable::input, 1) == Registers{0});
  start(1);
  CHECK(runs());
}

TEST_CASE("a product that has one function to write with refuses the other one") {
  auto product = bare({parameter("a", RegisterTable::holding, 0)});
  const auto single = modbus::write_request({0}, 5);
  const Registers words = {5};
  const auto multiple = modbus::write_request({0}, RegisterView(words));
  const auto answers = [&] {
    Simulated device(product);
    return std::pair(device.refused(single).value_or(0), device.refused(multiple).value_or(0));
  };
  CHECK(answers() == std::pair<std::uint8_t, std::uint8_t>(0, 0));
  product.profile.link.write_function = 6;
  CHECK(answers() == std::pair<std::uint8_t, std::uint8_t>(0, 1));
  product.profile.link.write_function = 16;
  product.profile.link.max_write = 1;
  CHECK(answers() == std::pair<std::uint8_t, std::uint8_t>(1, 0));
}

TEST_CASE("parts of a register are written without each other, each with its own limits") {
  auto low = parameter("low", RegisterTable::holding, 0, {.kind = Kind::u8, .slice = {0, 8}});
  low.range = {std::nullopt, Decimal(100)};
  auto high = parameter("high", RegisterTable::holding, 0, {.kind = Kind::i8, .slice = {8, 8}});
  high.range = {Decimal(-5), Decimal(5)};
  Simulated device(bare({low, high}));
  CHECK(device.read(RegisterTable::holding, 0) == Registers{0xFB00});
  CHECK(device.write(0, 0xFB64) == std::nullopt);
  CHECK(device.write(0, 0xFB65) == 3);
  CHECK(device.write(0, 0x0664) == 3);
  CHECK(device.write(0, 0x0564) == std::nullopt);
  CHECK(device.read(RegisterTable::holding, 0) == Registers{0x0564});
}

TEST_CASE("a register may be an action's, and have parts that are written by themselves") {
  const auto holding = RegisterTable::holding;
  auto product = bare({parameter("start", holding, 5, {.kind = Kind::u16, .slice = {0, 1}}),
                       parameter("speed", holding, 5, {.kind = Kind::u16, .slice = {4, 4}}),
                       parameter("fault", RegisterTable::input, 0)});
  auto reset = action("reset", holding, 5);
  reset.value = 2;
  product.profile.actions = {reset};
  product.profile.alarm_reset = "reset";
  product.profile.alarm_lists = {{"present", {"fault"}, catalogue::CodeTable::none}};
  Simulated device(product);
  device.tool->raise_alarm(1, 7, device.clock.now());
  CHECK(device.write(5, 0x31) == std::nullopt);
  CHECK(device.read(RegisterTable::input, 0) == Registers{7});
  CHECK(device.write(5, 2) == std::nullopt);
  CHECK(device.read(RegisterTable::input, 0) == Registers{0});
  CHECK(device.read(holding, 5) == Registers{2});
}

TEST_CASE("what is written elsewhere shows where it is read") {
  auto speed = parameter("speed", RegisterTable::holding, 0, {.kind = Kind::u32});
  speed.write_address = modbus::RegisterAddress{100};
  Simulated device(bare({speed}));
  CHECK(device.write(0, 1) == 2);
  CHECK(device.refused(modbus::write_request({100}, RegisterView(Registers{1, 2}))) ==
        std::nullopt);
  CHECK(device.write(101, 3) == std::nullopt);
  CHECK(device.read(RegisterTable::holding, 0, 2) == Registers{1, 3});
  CHECK(device.read(RegisterTable::holding, 100) == std::nullopt);
}

TEST_CASE("what is locked is refused until its key is written") {
  const auto at = [](catalogue::Text name, std::uint16_t address) {
    return parameter(std::move(name), RegisterTable::holding, address);
  };
  auto product = bare({at("key", 0), at("set.a", 1), at("b", 2)});
  product.profile.unlock = catalogue::UnlockSpec{"key", 99, {"set.*"}};
  Simulated device(product);
  CHECK(device.write(1, 1) == 3);
  CHECK(device.write(2, 1) == std::nullopt);
  CHECK(device.write(0, 99) == std::nullopt);
  CHECK(device.write(1, 1) == std::nullopt);
  CHECK(device.write(0, 0) == std::nullopt);
  CHECK(device.write(1, 2) == 3);
  CHECK(device.read(RegisterTable::holding, 0, 3) == Registers{0, 1, 1});
}

TEST_CASE("a device that works on an action answers writes with busy") {
  auto product = bare({parameter("a", RegisterTable::holding, 0)});
  auto save = action("save", RegisterTable::holding, 9);
  save.busy = 500ms;
  product.profile.actions = {save};
  product.profile.link.busy = {6};
  Simulated device(product);
  CHECK(device.write(9, 1) == std::nullopt);
  CHECK(device.write(0, 7) == 6);
  CHECK(device.read(RegisterTable::holding, 0) == Registers{0});
  device.clock.advance(500ms);
  CHECK(device.write(0, 7) == std::nullopt);
}

TEST_CASE("values of every kind begin at something that they can be") {
  const auto at = [](catalogue::Text name, std::uint16_t address, catalogue::Encoding encoding) {
    return parameter(std::move(name), RegisterTable::holding, address, encoding);
  };
  auto float_value = at("float", 0, {.kind = Kind::f32});
  float_value.range = {*Decimal::parse("1.5"), std::nullopt};
  auto scaled = at("scaled", 2, {.kind = Kind::u16, .scale = Decimal(20), .divisor = 32768});
  scaled.default_value = Decimal(10);
  auto null = at("null", 3, {.kind = Kind::u16});
  null.nulls = {0, 1};
  auto product =
      bare({float_value, scaled, null,
            at("text", 4, {.kind = Kind::text, .length = 4, .padding = catalogue::Padding::space}),
            at("date", 6, {.kind = Kind::date}), at("bcd", 12, {.kind = Kind::bcd, .length = 2}),
            at("list", 13, {.kind = Kind::u16, .count = 3})});
  product.start.values = {{"bcd", 1234}, {"list", 7}};
  Simulated device(product);
  CHECK(device.read(RegisterTable::holding, 0, 16) ==
        Registers{0x3FC0, 0, 0x4000, 2, 0x2020, 0x2020, 26, 1, 1, 0, 0, 0, 0x1234, 7, 7, 7});
  product.start.values = {{"float", 3}, {"text", 3}, {"date", 1'000'000'000}};
  Simulated other(product);
  CHECK(other.read(RegisterTable::holding, 0, 12) ==
        Registers{0x4040, 0, 0x4000, 2, 0x2020, 0x2020, 1, 9, 9, 1, 46, 40});
}

TEST_CASE("a motor tells its speed in the encodings of its set-point and its monitor") {
  const auto holding = RegisterTable::holding;
  auto product = bare(
      {parameter("command", holding, 0), parameter("set", holding, 1, {.kind = Kind::f32}),
       parameter("shown", RegisterTable::input, 0, {.kind = Kind::i16, .scale = Decimal(1, -1)}),
       parameter("exact", RegisterTable::input, 1, {.kind = Kind::f32})});
  product.profile.run = catalogue::RunSpec{catalogue::CommandRegisterSpec{
      .command = "command",
      .forward = 1,
      .reverse = 2,
      .stop = 0,
      .set_point = "set",
      .monitor = {.command_speed = "shown", .feedback_speed = "exact"}}};
  product.start.values = {{"set", 30}};
  Simulated device(product);
  CHECK(device.write(0, 2) == std::nullopt);
  device.wait(2s);
  CHECK(device.read(RegisterTable::input, 0, 3) == Registers{0xFED4, 0xC1F0, 0});
  CHECK(device.refused(modbus::write_request({1}, RegisterView(Registers{0x4148, 0}))) ==
        std::nullopt);  // 12.5
  device.wait(2s);
  CHECK(device.read(RegisterTable::input, 0, 3) == Registers{0xFF83, 0xC148, 0});
}
