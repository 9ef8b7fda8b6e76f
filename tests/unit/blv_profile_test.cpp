#include <doctest/doctest.h>

#include <string>

#include "spindle/catalogue/value.hpp"
#include "spindle/files/profile_store.hpp"
#include "spindle/posix/disk.hpp"

using namespace spindle;
using catalogue::Action;
using catalogue::Effect;
using catalogue::Parameter;
using catalogue::Profile;

namespace {

files::ProfileStore shipped() {
  return files::ProfileStore({SPINDLE_SOURCE_DIR "/profiles"}, posix::source_disk());
}

Profile blv() {
  auto profile = shipped().load("orientalmotor-blv");
  REQUIRE_MESSAGE(profile.has_value(), describe(profile.error()));
  return *std::move(profile);
}

std::uint16_t address_of(const Profile& profile, std::string_view name) {
  const auto parameter = profile.find(name);
  REQUIRE_MESSAGE(parameter.has_value(), describe(parameter.error()));
  return parameter->address.value;
}

}  // namespace

// The addresses that the manual's own text shows (protocol notes, section 4.9).
TEST_CASE("blv: addresses that are visible in the manual") {
  const Profile profile = blv();
  CHECK(address_of(profile, "command.group") == 0x0030);
  CHECK(address_of(profile, "warning.present") == 0x0096);
  CHECK(address_of(profile, "warning.history.1") == 0x0098);
  CHECK(address_of(profile, "monitor.operating-speed") == 0x0100);
  CHECK(address_of(profile, "monitor.operating-speed-decimals") == 0x0102);
  CHECK(address_of(profile, "operation.0.speed") == 0x0480);
  CHECK(address_of(profile, "operation.7.speed") == 0x048E);
  CHECK(address_of(profile, "operation.6.deceleration-time") == 0x068C);
  CHECK(address_of(profile, "operation.7.deceleration-time") == 0x068E);
  CHECK(address_of(profile, "operation.0.torque-limit") == 0x0700);
  CHECK(address_of(profile, "protection.overload-warning") == 0x10A2);
  CHECK(address_of(profile, "protection.undervoltage-warning") == 0x10A8);
  CHECK(address_of(profile, "protection.overload-warning-level") == 0x10AA);
  CHECK(address_of(profile, "io.x.0") == 0x1100);
  CHECK(address_of(profile, "io.net-in.7") == 0x116E);
  CHECK(address_of(profile, "io.net-in.8") == 0x1170);
  CHECK(address_of(profile, "io.net-out.7") == 0x118E);
  CHECK(address_of(profile, "io.net-out.8") == 0x1190);
}

TEST_CASE("blv: histories end where the notes say") {
  const Profile profile = blv();
  CHECK(address_of(profile, "alarm.history.10") == 0x0094);
  CHECK(address_of(profile, "warning.history.10") == 0x00AA);
  CHECK(address_of(profile, "communication-error.last") == 0x00AC);
  CHECK(address_of(profile, "communication-error.history.10") == 0x00C0);
}

TEST_CASE("blv: every value is a pair at an even address, inside the map") {
  for (const Parameter& parameter : blv().parameters) {
    CAPTURE(parameter.name);
    CHECK(catalogue::register_count(parameter.encoding) == 2);
    CHECK(parameter.address.value % 2 == 0);
    CHECK(parameter.address.value < 0x2000);
    CHECK_FALSE(parameter.source.empty());
  }
}

TEST_CASE("blv: speeds from 1 to 79 do not exist") {
  const auto speed = blv().find("operation.2.speed").value();
  for (const char* good : {"0", "80", "4000"}) CHECK(catalogue::parse_value(speed, good));
  for (const char* bad : {"-1", "1", "79", "4001"}) {
    CHECK_FALSE(catalogue::parse_value(speed, bad));
  }
  CHECK(catalogue::parse_value(speed, "100.5")->number == Decimal(101));
  CHECK_FALSE(catalogue::parse_exact_value(speed, "100.5"));
  CHECK(catalogue::encode(speed, {Decimal(1000)}) == Registers{0, 1000});
}

TEST_CASE("blv: when values take effect") {
  const Profile profile = blv();
  const auto effect = [&](const char* name) { return profile.find(name)->effect; };
  CHECK(effect("motor.input-mode") == Effect::after_configuration);
  CHECK(effect("motor.analog-input") == Effect::after_configuration);
  CHECK(effect("communication.parity") == Effect::after_power_cycle);
  CHECK(effect("communication.timeout") == Effect::at_once);
  CHECK(effect("protection.brake-at-alarm") == Effect::unknown);
  CHECK_FALSE(effect("alarm.present"));
  for (const char* name : {"parity", "stop-bits", "waiting-time"}) {
    CHECK_FALSE(profile.find(std::string("communication.") + name)->risk.empty());
  }
}

TEST_CASE("blv: what cannot be known stays unknown") {
  const Profile profile = blv();
  for (const char* name : {"operation.0.speed", "motor.jog-speed", "motor.rotation-direction",
                           "protection.overload-warning-level"}) {
    CHECK_FALSE(profile.find(name)->default_value);
  }
  CHECK(profile.find("operation.0.torque-limit")->default_value == Decimal(200));
  CHECK_FALSE(profile.find("motor.speed-increasing-ratio")->default_value);
  CHECK_FALSE(profile.find("io.net-in.6")->default_value);
  CHECK_FALSE(profile.identity);
}

TEST_CASE("blv: every fact has the evidence that it was found with") {
  using catalogue::Evidence;
  const Profile profile = blv();
  const std::pair<const char*, Evidence> expected[] = {
      {"operation.2.speed", Evidence::transcribed},
      {"operation.2.acceleration-time", Evidence::transcribed},
      {"operation.2.torque-limit", Evidence::transcribed},
      {"motor.rotation-direction", Evidence::transcribed},
      {"motor.analog-input", Evidence::transcribed},
      {"motor.speed-increasing-ratio", Evidence::manual},
      {"communication.parity", Evidence::transcribed},
      {"communication.stop-bits", Evidence::transcribed},
      {"communication.error-limit", Evidence::transcribed},
      {"protection.undervoltage-warning", Evidence::manual},
      {"protection.power-on-prevention", Evidence::inferred},
      {"protection.overload-warning", Evidence::inferred},
      {"io.net-in.6", Evidence::sibling},
      {"io.net-in.7", Evidence::manual},
      {"io.net-in.8", Evidence::manual},
      {"io.net-in.9", Evidence::sibling},
      {"io.net-out.7", Evidence::manual},
      {"io.net-out.8", Evidence::sibling},
  };
  for (const auto& [name, evidence] : expected) {
    CAPTURE(name);
    CHECK(profile.find(name)->evidence == evidence);
  }
  CHECK(profile.find_action("initialize")->evidence == Evidence::sibling);
}

TEST_CASE("blv: initial values and limits that the manual and its readers show") {
  const Profile profile = blv();
  const auto start = [&](const char* name) { return profile.find(name)->default_value; };
  CHECK(start("io.net-in.7") == Decimal(20));
  CHECK(start("io.net-in.8") == Decimal(0));
  CHECK(start("io.net-out.7") == Decimal(65));
  CHECK(start("motor.analog-input") == Decimal(0));
  CHECK(address_of(profile, "io.net-in.0") == 0x1160);
  CHECK(address_of(profile, "io.net-in.15") == 0x117E);
  CHECK(address_of(profile, "io.net-out.0") == 0x1180);
  CHECK(address_of(profile, "io.net-out.15") == 0x119E);
  const auto takes = [&](const char* name, const char* text) {
    return catalogue::parse_value(profile.find(name).value(), text).has_value();
  };
  for (const char* mode : {"0", "1", "2", "3", "4", "5", "digital"}) {
    CHECK(takes("motor.analog-input", mode));
  }
  CHECK_FALSE(takes("motor.analog-input", "6"));
  CHECK(takes("command.driver-input", "0x8000"));
  CHECK_FALSE(takes("command.driver-input", "65536"));
  CHECK(takes("communication.error-limit", "0"));
  CHECK_FALSE(takes("communication.error-limit", "11"));
  REQUIRE(profile.link.units);
  CHECK(profile.link.units->contains({31}));
  CHECK_FALSE(profile.link.units->contains({32}));
}

TEST_CASE("blv: what a user has to know stands beside the entry") {
  const Profile profile = blv();
  const auto note = [&](const char* name) { return profile.find(name)->note; };
  CHECK(note("operation.0.speed").find("took it as 0") != std::string::npos);
  CHECK(note("status.driver-output").find("bit 7 is on in an alarm") != std::string::npos);
  CHECK(profile.find_action("configure")->note.find("up to 1 s") != std::string::npos);
  CHECK(profile.find_action("initialize")->title.find("waiting time") != std::string::npos);
  CHECK(profile.run->still_runs.find("CN4") != std::string::npos);
  const auto tables = shipped().load_code_tables("orientalmotor-blv");
  REQUIRE(tables);
  CHECK(tables->error.at(0x46).remedy ==
        "switch the run inputs off, then switch the main supply off and on");
}

// Protocol notes, sections 2.1 and 5.
TEST_CASE("blv: the words that run the motor") {
  const Profile profile = blv();
  REQUIRE(profile.run);
  REQUIRE(profile.run->word() != nullptr);
  const catalogue::CommandWordSpec& run = *profile.run->word();
  const auto& two_wire = run.modes.at(0);
  const auto& three_wire = run.modes.at(1);
  const std::uint16_t second = run.selecting(2);
  CHECK((two_wire.forward | second) == 0x2A);
  CHECK((two_wire.reverse | second) == 0x32);
  CHECK((two_wire.decelerate | second) == 0x22);
  CHECK((two_wire.instant | second) == 0x02);
  CHECK((three_wire.forward | second) == 0x1A);
  CHECK((three_wire.reverse | second) == 0x3A);
  CHECK((three_wire.decelerate | second) == 0x12);
  CHECK((three_wire.instant | second) == 0x0A);
  CHECK(run.decelerate_always == 0x20);
  CHECK(run.instant_always == 0x00);
  CHECK(run.preferred == 2);
}

TEST_CASE("blv: maintenance commands are edges on their odd registers") {
  const Profile profile = blv();
  const std::pair<const char*, std::uint16_t> expected[] = {{"alarm-reset", 0x0181},
                                                            {"clear-alarm-history", 0x0185},
                                                            {"clear-warning-history", 0x0187},
                                                            {"clear-communication-history", 0x0189},
                                                            {"configure", 0x018D},
                                                            {"initialize", 0x018F},
                                                            {"load", 0x0191},
                                                            {"save", 0x0193},
                                                            {"initialize-all", 0x0195}};
  for (const auto& [name, address] : expected) {
    CAPTURE(name);
    const Action action = profile.find_action(name).value();
    CHECK(action.address.value == address);
    CHECK(action.value == 1);
    CHECK(action.rest == 0);
  }
  CHECK(profile.find_action("alarm-reset")->prepare->clear == 0x18);
  CHECK(profile.find_action("initialize-all")->hazard == catalogue::Hazard::link);
  CHECK(profile.find_action("group")->encoding.kind == catalogue::Kind::i32);
}

TEST_CASE("blv: codes have texts, and alarms say whether they can be reset") {
  const auto tables = shipped().load_code_tables("orientalmotor-blv");
  REQUIRE(tables);
  CHECK(tables->error.size() == 17);
  CHECK(tables->warning.size() == 5);
  for (const auto& [code, text] : tables->error) {
    CAPTURE(code);
    const bool permanent = code == 0x20 || code == 0x41 || code == 0x83;
    CHECK(text.resettable == (permanent ? catalogue::Resettable::no : catalogue::Resettable::yes));
    CHECK_FALSE(text.remedy.empty());
  }
  const Profile profile = blv();
  REQUIRE(profile.refusals);
  CHECK(profile.refusals->codes.size() == 6);
  CHECK(profile.refusals->is_busy(0x89));
  CHECK(profile.refusals->is_busy(0x8A));
  CHECK_FALSE(profile.refusals->is_busy(0x8D));
  CHECK(profile.alarm_lists.size() == 5);
}
