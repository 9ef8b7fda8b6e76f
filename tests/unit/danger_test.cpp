#include "spindle/catalogue/danger.hpp"

#include <doctest/doctest.h>

#include <set>
#include <string>
#include <vector>

#include "spindle/catalogue/snapshot.hpp"
#include "spindle/files/profile_store.hpp"
#include "spindle/posix/disk.hpp"
#include "support/edit_list.hpp"

using namespace spindle;
using namespace spindle::catalogue;

namespace {

Parameter parameter(std::string name, std::uint16_t address, Kind kind = Kind::u16) {
  Parameter made;
  made.name = std::move(name);
  made.address = {address};
  made.encoding.kind = kind;
  made.access = Access::read_write;
  return made;
}

Action action(std::string name, std::uint16_t address, Hazard hazard) {
  Action made;
  made.name = std::move(name);
  made.address = {address};
  made.value = 1;
  made.hazard = hazard;
  return made;
}

/// Registers 1 to 40 by number; 10 starts, 20 is declared, 30 acts on a change, 50 locks.
Profile machine() {
  Profile profile;
  profile.id = "machine";
  profile.numbered = NumberedSpec{
      .prefix = "p", .from = 1, .to = 40, .access = Access::read_write, .source = "manual"};
  profile.parameters = {parameter("word", 10), parameter("brake", 20), parameter("speed", 12),
                        parameter("lock", 50), parameter("pair", 49, Kind::u32)};
  test::edit(profile.parameters, 1, [](auto& entry) { entry.hazard = Hazard::moves; });
  profile.actions = {action("start", 10, Hazard::moves), action("reset", 30, Hazard::none),
                     action("lock", 50, Hazard::locks), action("look", 12, Hazard::none)};
  test::edit(profile.actions, 0, [](auto& entry) { entry.stop_value = 0; });
  test::edit(profile.actions, 1, [](auto& entry) { entry.rest = 0; });
  profile.run.emplace().model = StartActionSpec{.start = "start"};
  return profile;
}

std::vector<std::string> names_of(const std::vector<Parameter>& parameters) {
  std::vector<std::string> names;
  for (const Parameter& one : parameters) names.push_back(one.name);
  return names;
}

bool contains(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

}  // namespace

TEST_CASE("what shares a register with something that acts is no setting, by whatever name") {
  const Profile profile = machine();
  struct Row {
    std::string name;
    Hazard hazard;
    std::string action;
  };
  const std::vector<Row> rows = {
      {"word", Hazard::moves, "start"},
      {"p10", Hazard::moves, "start"},
      {"@holding:10", Hazard::moves, "start"},
      {"@holding:9/u32", Hazard::moves, "start"},
      {"@holding:10/i32", Hazard::moves, "start"},
      {"brake", Hazard::moves, ""},
      {"p20", Hazard::moves, ""},
      {"@holding:19/u32", Hazard::moves, ""},
      {"p30", Hazard::unclear, "reset"},
      {"lock", Hazard::locks, "lock"},
      {"pair", Hazard::locks, "lock"},
      {"speed", Hazard::none, ""},
      {"p11", Hazard::none, ""},
      {"@holding:11", Hazard::none, ""},
      {"@input:10", Hazard::none, ""},
      {"@holding:11/u32", Hazard::none, ""},
  };
  for (const Row& row : rows) {
    CAPTURE(row.name);
    const auto danger = danger_of(profile.find(row.name).value(), profile);
    CHECK(danger.has_value() == (row.hazard != Hazard::none));
    if (!danger) continue;
    CHECK(danger->hazard == row.hazard);
    CHECK(danger->action == row.action);
    CHECK_FALSE(danger->effect().empty());
    CHECK(danger->remedy().empty() == row.action.empty());
  }
}

TEST_CASE("no backup holds what is no setting") {
  const Profile profile = machine();
  const auto stored = stored_parameters(profile);
  const auto names = names_of(stored);
  for (const char* name : {"word", "p10", "brake", "p20", "p30", "lock", "pair"}) {
    CAPTURE(name);
    CHECK_FALSE(contains(names, name));
  }
  CHECK(contains(names, "speed"));
  CHECK(contains(names, "p11"));
  CHECK(stored.size() == 40 - 3);
}

TEST_CASE("a guarded start is proposed only where the profile has a run model") {
  Profile profile = machine();
  const std::string guarded = danger_of(profile.parameters[0], profile)->remedy();
  CHECK(guarded.find("remote-start") != std::string::npos);
  profile.run->model = StartActionSpec{.start = "look"};
  CHECK(danger_of(profile.parameters[0], profile)->remedy().empty());
  profile.run.reset();
  CHECK(danger_of(profile.parameters[0], profile)->remedy().empty());
}

TEST_CASE("every register that commands a motor is no setting") {
  Profile profile;
  profile.parameters = {parameter("go", 1), parameter("halt", 2), parameter("hold", 3),
                        parameter("speed", 4)};
  CommandRegisterSpec facts{.command = "go", .stop_register = "halt", .set_point = "speed"};
  facts.enable.parameter = "hold";
  profile.run.emplace().model = facts;
  CHECK(names_of(stored_parameters(profile)) == std::vector<std::string>{"speed"});
  CHECK(danger_of(profile.parameters[2], profile)->runs_motor);
}

TEST_CASE("the gravest hazard of a register counts") {
  Profile profile = machine();
  test::append(profile.actions, action("erase", 10, Hazard::erases));
  test::append(profile.actions, action("go", 50, Hazard::moves));
  CHECK(danger_of(profile.parameters[0], profile)->action == "start");
  CHECK(danger_of(profile.parameters[3], profile)->action == "go");
}

TEST_CASE("the word that runs a motor is no setting, though no action says so") {
  Profile profile;
  profile.parameters = {parameter("word", 124, Kind::u32), parameter("speed", 130)};
  profile.run.emplace().model = catalogue::CommandWordSpec{.command = "word"};
  const auto danger = danger_of(parse_raw_register("@holding:125")->value(), profile);
  REQUIRE(danger.has_value());
  CHECK(danger->runs_motor);
  CHECK(danger->hazard == Hazard::moves);
  CHECK(danger->effect() == "it may start the motor");
  CHECK(names_of(stored_parameters(profile)) == std::vector<std::string>{"speed"});
}

TEST_CASE("a motion without an end") {
  Action jog = action("jog", 1, Hazard::moves);
  CHECK(moves_without_end(jog));
  jog.stop_value = 0;
  CHECK_FALSE(moves_without_end(jog));
  CHECK_FALSE(moves_without_end(action("lock", 1, Hazard::locks)));
  Action stop = action("stop", 1, Hazard::moves);
  stop.motion = Motion::stop;
  CHECK_FALSE(moves_without_end(stop));
}

TEST_CASE("of the shipped profiles, only the words that run a motor are left out of backups") {
  const std::set<std::string> commands = {"command.driver-input", "command.input", "command",
                                          "command.stop-operation"};
  const files::ProfileStore store({SPINDLE_SOURCE_DIR "/profiles"}, posix::source_disk());
  for (const files::ProfileEntry& entry : store.list()) {
    const Profile profile = store.load(entry.id).value();
    for (const Parameter& one : profile.parameters) {
      if (one.access == Access::read_only) continue;
      CAPTURE(one.name);
      CHECK(danger_of(one, profile).has_value() == commands.contains(one.name));
    }
  }
}

TEST_CASE("a write elsewhere is as dangerous as what stands there") {
  Profile profile;
  profile.actions = {action("go", 20, Hazard::moves)};
  Parameter around = parameter("around", 3);
  around.write_address = modbus::RegisterAddress{20};
  Parameter eraser = parameter("eraser", 7);
  eraser.write_address = modbus::RegisterAddress{32};
  eraser.hazard = Hazard::erases;
  profile.parameters = {around, eraser, parameter("harmless", 8)};
  CHECK(danger_of(around, profile)->hazard == Hazard::moves);
  CHECK(danger_of(parameter("@holding:32", 32), profile)->hazard == Hazard::erases);
  CHECK(danger_of(parameter("@holding:7", 7), profile)->hazard == Hazard::erases);
  CHECK(names_of(stored_parameters(profile)) == std::vector<std::string>{"harmless"});
}

TEST_CASE("parts of one long value are all stored, each once") {
  Profile profile;
  const auto part = [](std::string name, std::uint8_t first, std::uint8_t width) {
    Parameter made = parameter(std::move(name), 10, Kind::u32);
    made.encoding.slice = {first, width};
    return made;
  };
  profile.parameters = {part("low", 0, 8), part("high", 16, 8), part("middle", 8, 8),
                        part("again", 20, 2), part("end", 24, 8)};
  CHECK(names_of(stored_parameters(profile)) ==
        std::vector<std::string>{"low", "high", "middle", "end"});
}

TEST_CASE("a secret is stored under no other name in the open") {
  Profile profile;
  Parameter pin = parameter("pin", 41);
  pin.secrecy = Secrecy::secret;
  profile.parameters = {parameter("wide", 40, Kind::u32), pin};
  for (const Parameter& stored : stored_parameters(profile)) {
    CHECK(stored.secrecy == Secrecy::secret);
  }
}
