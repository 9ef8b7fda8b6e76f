#include "spindle/catalogue/profile.hpp"

#include <doctest/doctest.h>

#include <string>
#include <vector>

#include "spindle/catalogue/meaning.hpp"
#include "support/edit_list.hpp"

using namespace spindle;
using namespace spindle::catalogue;
using modbus::RegisterAddress;
using modbus::RegisterTable;

namespace {

Parameter named(std::string name, RegisterTable table, std::uint16_t address, Kind kind,
                Access access) {
  return {.name = std::move(name),
          .title = {},
          .table = table,
          .address = {address},
          .encoding = {.kind = kind},
          .unit = {},
          .access = access,
          .source = {},
          .note = {}};
}

Profile example() {
  constexpr auto holding = RegisterTable::holding;
  constexpr auto input = RegisterTable::input;
  Profile profile;
  profile.id = "example";
  profile.numbered = NumberedSpec{.prefix = "p",
                                  .table = holding,
                                  .from = 1,
                                  .to = 725,
                                  .access = Access::read_write,
                                  .evidence = Evidence::manual,
                                  .source = "manual"};
  profile.limits = LimitSpec{.minimum_offset = 1000, .maximum_offset = 2000, .from = 1, .to = 724};
  profile.parameters = {
      named("preset.1.speed", holding, 8, Kind::u16, Access::read_write),
      named("preset.1.target-torque", holding, 2, Kind::u16, Access::read_write),
      named("preset.2.target-torque", holding, 17, Kind::u16, Access::read_write),
      named("status.alarm", input, 3308, Kind::u16, Access::read_only),
      named("drive.speed", holding, 1152, Kind::i32, Access::read_write),
      named("drive.state", holding, 126, Kind::u32, Access::read_only),
  };
  profile.actions = {
      Action{.name = "alarm-reset", .title = {}, .source = {}, .check = {}, .confirm = {}},
      Action{.name = "start", .title = {}, .source = {}, .check = {}, .confirm = {}}};
  return profile;
}

std::vector<std::string> selected(const std::vector<std::string>& names) {
  const auto found = example().select(names);
  if (!found) return {describe(found.error())};
  std::vector<std::string> result;
  for (const Parameter& parameter : *found) result.push_back(parameter.name);
  return result;
}

std::string find_error(std::string_view name) {
  const auto found = example().find(name);
  return found ? "found" : describe(found.error());
}

using Names = std::vector<std::string>;

}  // namespace

TEST_CASE("find: named parameters") {
  CHECK(example().find("preset.1.speed")->address.value == 8);
  CHECK(find_error("preset.1.speeed") ==
        "preset.1.speeed: no such parameter in profile example; did you mean 'preset.1.speed'?");
  CHECK(example().find("").error().code == Errc::unknown_name);
}

TEST_CASE("find: numbered parameters, also where a named one has the register") {
  const auto p2 = example().find("p2");
  REQUIRE(p2.has_value());
  CHECK(p2->name == "p2");
  CHECK(p2->address.value == 2);
  CHECK(p2->encoding.kind == Kind::u16);
  CHECK(p2->encoding.scale == Decimal(1));
  CHECK(p2->access == Access::read_write);
  CHECK(p2->evidence == Evidence::manual);
  CHECK(example().find("p725")->address.value == 725);
  CHECK(example().find("p007")->name == "p7");
  CHECK(find_error("p0") == "p0: no such parameter in profile example; numbers go from p1 to p725");
  CHECK(find_error("p726") ==
        "p726: no such parameter in profile example; numbers go from p1 to p725");
  CHECK(find_error("p99999999999999999999").find("numbers go from") != std::string::npos);
  CHECK(example().find("p").error().code == Errc::unknown_name);
  CHECK(example().find("p0x1").error().code == Errc::unknown_name);
  CHECK(example().find("p-1").error().code == Errc::unknown_name);
}

TEST_CASE("find: raw registers may be written where a parameter may") {
  struct Row {
    const char* text;
    const char* name;
    RegisterTable table;
    std::uint16_t address;
    Kind kind;
    Access access;
  };
  constexpr auto holding = RegisterTable::holding;
  constexpr auto input = RegisterTable::input;
  const std::vector<Row> rows = {
      {"@holding:2", "@holding:2", holding, 2, Kind::u16, Access::read_write},
      {"@holding:0x0480", "@holding:1152", holding, 1152, Kind::u16, Access::read_write},
      {"@holding:1153", "@holding:1153", holding, 1153, Kind::u16, Access::read_write},
      {"@holding:1154", "@holding:1154", holding, 1154, Kind::u16, Access::read_only},
      {"@holding:1152/i32", "@holding:1152/i32", holding, 1152, Kind::i32, Access::read_write},
      {"@holding:725/u32", "@holding:725/u32", holding, 725, Kind::u32, Access::read_only},
      {"@holding:4500", "@holding:4500", holding, 4500, Kind::u16, Access::read_only},
      {"@input:3204/i16", "@input:3204/i16", input, 3204, Kind::i16, Access::read_only},
      {"@input:2/u16", "@input:2", input, 2, Kind::u16, Access::read_only},
      {"@input:65535", "@input:65535", input, 65535, Kind::u16, Access::read_only},
  };
  for (const Row& row : rows) {
    CAPTURE(row.text);
    const auto found = example().find(row.text);
    REQUIRE(found.has_value());
    CHECK(found->name == row.name);
    CHECK(found->table == row.table);
    CHECK(found->address.value == row.address);
    CHECK(found->encoding.kind == row.kind);
    CHECK(found->access == row.access);
  }
}

TEST_CASE("parse_raw_register: what is none") {
  CHECK_FALSE(parse_raw_register("holding:2").has_value());
  CHECK_FALSE(parse_raw_register("").has_value());
  for (const char* text :
       {"@", "@holding", "@holding:", "@coils:1", "@coil:1/u16", "@holding:65536", "@holding:-1",
        "@holding:2/", "@holding:2/f16", "@holding:2/text", "@holding:2/bcd9", "@holding:2/i16/u16",
        "@:2", "@holding: 2", "@input:65535/u32"}) {
    CAPTURE(text);
    const auto raw = parse_raw_register(text);
    REQUIRE(raw.has_value());
    REQUIRE_FALSE(raw->has_value());
    CHECK(raw->error().code == Errc::unknown_name);
    CHECK(raw->error().name == text);
  }
}

TEST_CASE("select: order asked for, catalogue order in patterns, each once") {
  CHECK(selected({}) == Names{"preset.1.speed", "preset.1.target-torque", "preset.2.target-torque",
                              "status.alarm", "drive.speed", "drive.state"});
  CHECK(
      selected({"status.alarm", "preset.*.target-torque", "preset.1.*"}) ==
      Names{"status.alarm", "preset.1.target-torque", "preset.2.target-torque", "preset.1.speed"});
  CHECK(selected({"p2", "p2", "@holding:2", "@holding:0x2", "p02"}) == Names{"p2", "@holding:2"});
}

TEST_CASE("select: patterns mean numbered parameters only when they match no named one") {
  CHECK(selected({"p72?"}) == Names{"p720", "p721", "p722", "p723", "p724", "p725"});
  CHECK(selected({"p[12]"}) == Names{"p1", "p2"});
  CHECK(selected({"p*"}) ==
        Names{"preset.1.speed", "preset.1.target-torque", "preset.2.target-torque"});
}

TEST_CASE("select: the first thing that does not exist is the error") {
  CHECK(selected({"preset.1.speed", "preset.9.*"}) ==
        Names{"preset.9.*: matches no parameter of profile example; 'spindle list' shows the names "
              "that the profile knows"});
  CHECK(selected({"nothing.like.it.at.all", "preset.9.*"}) ==
        Names{"nothing.like.it.at.all: no such parameter in profile example; 'spindle list' shows "
              "the names that the profile knows"});
}

TEST_CASE("find_action") {
  CHECK(example().find_action("start")->name == "start");
  const auto misspelt = example().find_action("alarm-rest");
  REQUIRE_FALSE(misspelt.has_value());
  CHECK(describe(misspelt.error()) ==
        "alarm-rest: no such action in profile example; did you mean 'alarm-reset'?");
}

TEST_CASE("find_action without a similar name says where they are listed") {
  const auto none = example().find_action("quite-another-thing");
  REQUIRE_FALSE(none.has_value());
  CHECK(none.error().hint == "'spindle do TARGET' lists the actions");
}

TEST_CASE("writable: parameters only, both halves of a pair") {
  const Profile profile = example();
  for (const std::uint16_t address : std::vector<std::uint16_t>{1, 564, 725, 1152, 1153}) {
    CAPTURE(address);
    CHECK(profile.writable(modbus::RegisterTable::holding, {address}));
  }
  for (const std::uint16_t address :
       std::vector<std::uint16_t>{0, 726, 1001, 1151, 1154, 3308, 4002, 4500, 65535}) {
    CAPTURE(address);
    CHECK_FALSE(profile.writable(modbus::RegisterTable::holding, {address}));
  }
  Profile nothing_numbered = example();
  nothing_numbered.numbered.reset();
  CHECK_FALSE(
      nothing_numbered.writable(modbus::RegisterTable::holding, {126}));  // named, but read-only
  CHECK_FALSE(nothing_numbered.writable(modbus::RegisterTable::holding, {3}));
  CHECK(nothing_numbered.writable(modbus::RegisterTable::holding, {2}));
}

TEST_CASE("limit_registers: parameter n at n + offset (DOGA 60427 §3.1: 1001-1724, 2001-2724)") {
  const Profile profile = example();
  const auto limits = profile.limit_registers(*profile.find("p724"));
  REQUIRE(limits.has_value());
  CHECK(limits->minimum.value == 1724);
  CHECK(limits->maximum.value == 2724);
  CHECK(profile.limit_registers(*profile.find("preset.2.target-torque"))->minimum.value == 1017);
  CHECK_FALSE(profile.limit_registers(*profile.find("p725")).has_value());
  CHECK_FALSE(profile.limit_registers(*profile.find("status.alarm")).has_value());
  CHECK_FALSE(profile.limit_registers(*profile.find("drive.state")).has_value());  // 32 bits
  Profile without = example();
  without.limits.reset();
  CHECK_FALSE(without.limit_registers(*without.find("p1")).has_value());
}

TEST_CASE("kinds: sizes, bounds and names") {
  CHECK(register_count({.kind = Kind::i16}) == 1);
  CHECK(register_count({.kind = Kind::u32}) == 2);
  CHECK(lowest({.kind = Kind::i32}) == Decimal(-2147483648LL));
  CHECK(highest({.kind = Kind::u32}) == Decimal(4294967295LL));
}

TEST_CASE("a secret is one by whatever name or number its registers are asked for") {
  Profile profile = example();
  Parameter pin = named("pin", RegisterTable::holding, 300, Kind::u32, Access::read_write);
  pin.secrecy = Secrecy::secret;
  test::append(profile.parameters, pin);
  test::append(profile.parameters,
               named("half", RegisterTable::holding, 301, Kind::u16, Access::read_write));
  for (const std::string name : {"pin", "half", "p300", "p301", "@holding:300", "@holding:301/i16",
                                 "@holding:299/u32", "@holding:301/u32"}) {
    CAPTURE(name);
    CHECK(profile.find(name).value().secrecy == Secrecy::secret);
    CHECK(profile.select({name}).value().front().secrecy == Secrecy::secret);
  }
  for (const std::string name :
       {"p299", "p302", "@holding:302", "@holding:298/u32", "@input:300", "preset.1.speed"}) {
    CAPTURE(name);
    CHECK(profile.find(name).value().secrecy == Secrecy::open);
  }
  CHECK(profile.numbered_parameter(301).secrecy == Secrecy::secret);
  CHECK(profile.select({"p30?"}).value().at(1).secrecy == Secrecy::secret);
}

TEST_CASE("what reading clears is read by its own name only") {
  Profile profile;
  Parameter pulses = named("pulses", RegisterTable::input, 10, Kind::u32, Access::read_only);
  pulses.reading = catalogue::Reading::consumes;
  profile.parameters = {named("before", RegisterTable::input, 9, Kind::u16, Access::read_only),
                        pulses};
  CHECK(profile.find("pulses").has_value());
  CHECK(profile.select({"pulses"})->size() == 1);
  for (const std::vector<std::string>& names :
       {std::vector<std::string>{}, {"*"}, {"pul*"}, {"before"}}) {
    const auto selected = profile.select(names);
    if (!selected) continue;
    for (const Parameter& parameter : *selected) CHECK(parameter.name == "before");
  }
  for (const char* name : {"@input:10", "@input:11", "@input:9/u32", "@input:0..31"}) {
    CAPTURE(name);
    const auto selected = profile.select({name});
    REQUIRE(!selected.has_value());
    CHECK(selected.error().code == Errc::usage);
    CHECK(selected.error().hint == "'pulses' is read when it is named");
  }
}

TEST_CASE("what reading clears is read by nothing but the source of events") {
  Profile profile;
  Parameter flag = named("result.new", RegisterTable::input, 294, Kind::u16, Access::read_only);
  flag.reading = catalogue::Reading::consumes;
  profile.events.emplace();
  profile.events->flag = "result.new";
  const Parameter other =
      named("result.ok", RegisterTable::input, 303, Kind::u16, Access::read_only);
  profile.parameters = {flag, other};
  for (const char* name : {"result.new", "@input:294", "@input:293/u32", "@input:294/i32"}) {
    CAPTURE(name);
    const auto found = profile.find(name);
    REQUIRE(!found.has_value());
    CHECK(found.error().code == Errc::usage);
    CHECK(!profile.select({name}).has_value());
  }
  CHECK(profile.find("@holding:294").has_value());
  CHECK(profile.find("@input:295").has_value());
  for (const std::vector<std::string>& names :
       {std::vector<std::string>{}, {"*"}, {"result.*"}, {"result.ok"}}) {
    const auto selected = profile.select(names);
    REQUIRE(selected.has_value());
    REQUIRE(selected->size() == 1);
    CHECK(selected->front().name == "result.ok");
  }
  const auto only_it = profile.select({"result.n*"});
  REQUIRE(!only_it.has_value());
  CHECK(only_it.error().code == Errc::unknown_name);
  CHECK(profile.describe({})->size() == 2);
  CHECK(profile.describe({"result.new"})->front().name == "result.new");
}

TEST_CASE("a bit by name is where its field is") {
  Profile profile;
  Parameter wide = named("long", RegisterTable::holding, 80, Kind::u64, Access::read_write);
  wide.bits = {{0, "x", std::nullopt, 1}, {40, "y", std::nullopt, 1}};
  Parameter half = named("half", RegisterTable::holding, 90, Kind::u8, Access::read_write);
  half.encoding.slice = {8, 8};
  half.bits = {{0, "a", std::nullopt, 1}, {4, "mode", std::nullopt, 3}};
  Parameter moving = named("moving", RegisterTable::holding, 91, Kind::u16, Access::read_write);
  moving.bits = {{3, "go", 0, 1}, {5, "go", 1, 1}};
  moving.bits_by = "mode";
  profile.parameters = {wide, half, moving};
  const auto y = profile.find("long.y").value();
  CHECK(y.encoding.kind == Kind::u64);
  CHECK(y.encoding.slice.first == 40);
  const auto mode = profile.find("half.mode").value();
  CHECK(mode.encoding.kind == Kind::u16);
  CHECK(mode.encoding.slice.first == 12);
}

TEST_CASE("which bit a name means may depend on another parameter") {
  Profile profile;
  Parameter moving = named("moving", RegisterTable::holding, 91, Kind::u16, Access::read_write);
  moving.bits = {{3, "go", 0, 1}, {5, "go", 1, 1}, {7, "halt", 1, 1}};
  moving.bits_by = "mode";
  profile.parameters = {moving};
  const auto go = profile.find("moving.go").value();
  // Before that is known it is never taken for the register.
  CHECK(decode(go, Registers{8}).error().message == "which bit it is depends on mode");
  CHECK_FALSE(encode(go, {Decimal(1)}, Registers{0}));
  const auto while_mode = [&](const Parameter& parameter, std::int64_t mode) {
    return meant_by_others(parameter, [&](std::string_view) { return Value{Decimal(mode)}; });
  };
  CHECK(while_mode(go, 0)->encoding.slice == BitSlice{3, 1});
  CHECK(while_mode(go, 1)->encoding.slice == BitSlice{5, 1});
  CHECK(while_mode(go, 1)->name == "moving.go");
  const auto halt = while_mode(profile.find("moving.halt").value(), 0);
  REQUIRE_FALSE(halt);
  CHECK(halt.error().message == "it has no bit 'halt' while mode is 0");
  CHECK(halt.error().hint == "it has go now");
  const auto unread = meant_by_others(go, [](std::string_view) -> Result<Value> {
    return tl::unexpected(Error{.code = Errc::no_answer});
  });
  CHECK(unread.error().code == Errc::no_answer);
}

TEST_CASE("what is guarded is so by whatever name or number its registers are asked for") {
  Profile profile = example();
  Parameter unit = named("unit", RegisterTable::holding, 300, Kind::u32, Access::read_write);
  unit.guarding = catalogue::Guarding::alone;
  CHECK_FALSE(profile.has_guarded());
  test::append(profile.parameters, unit);
  CHECK(profile.has_guarded());
  for (const std::string name : {"unit", "p300", "p301", "@holding:301", "@holding:299/u32"}) {
    CAPTURE(name);
    CHECK(profile.find(name).value().guarding == catalogue::Guarding::alone);
    CHECK(profile.find(name).value().secrecy == Secrecy::open);
  }
  for (const std::string name : {"p299", "p302", "@input:300"}) {
    CAPTURE(name);
    CHECK(profile.find(name).value().guarding == catalogue::Guarding::none);
  }
}

TEST_CASE("where writes are listed nothing else may be written") {
  Profile profile;
  profile.id = "listed";
  profile.writes = catalogue::Writes::listed;
  Parameter elsewhere =
      named("elsewhere", RegisterTable::holding, 30, Kind::u16, Access::read_write);
  elsewhere.write_address = modbus::RegisterAddress{40};
  profile.parameters = {named("torque", RegisterTable::holding, 10, Kind::f32, Access::read_write),
                        named("shown", RegisterTable::holding, 20, Kind::u16, Access::read_only),
                        elsewhere,
                        named("lamp", RegisterTable::coil, 10, Kind::bit, Access::read_write)};
  catalogue::Action start;
  start.name = "start";
  start.address = {5000};
  profile.actions = {start};
  const auto allows = [&](RegisterTable table, unsigned first, std::size_t count = 1) {
    return profile.may_write(table, {static_cast<std::uint16_t>(first)}, count).has_value();
  };
  CHECK(allows(RegisterTable::holding, 10, 2));
  const auto half = profile.may_write(RegisterTable::holding, {11}, 1);
  REQUIRE_FALSE(half);
  CHECK(message_of(half.error()) ==
        "this is a part of torque, whose 2 registers are written together");
  CHECK(allows(RegisterTable::holding, 40));
  CHECK(allows(RegisterTable::coil, 10));
  CHECK(allows(RegisterTable::holding, 5000));
  for (const unsigned first : {0U, 9U, 12U, 20U, 30U, 4999U, 5001U, 65535U}) {
    CAPTURE(first);
    CHECK_FALSE(allows(RegisterTable::holding, first));
  }
  CHECK_FALSE(allows(RegisterTable::holding, 9, 2));
  CHECK_FALSE(allows(RegisterTable::holding, 11, 2));
  CHECK_FALSE(allows(RegisterTable::coil, 11));
  const auto refused = profile.may_write(RegisterTable::holding, {11}, 2);
  CHECK(refused.error().code == Errc::read_only);
  CHECK(refused.error().register_address == 12);
  profile.writes = catalogue::Writes::any;
  CHECK(allows(RegisterTable::holding, 9, 20));
}
