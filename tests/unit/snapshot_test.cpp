#include "spindle/catalogue/snapshot.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "support/bm_profile.hpp"
#include "support/edit_list.hpp"

using namespace spindle;
using namespace spindle::catalogue;

namespace {

Parameter parameter(std::string name, std::uint16_t address, Access access = Access::read_write) {
  Parameter made;
  made.name = std::move(name);
  made.address = {address};
  made.access = access;
  return made;
}

/// Four numbered parameters, the second of which has a name and a scale; the tool reports limits.
Profile small_profile() {
  Profile profile;
  profile.id = "small";
  profile.limits = LimitSpec{.minimum_offset = 100, .maximum_offset = 200, .from = 1, .to = 3};
  profile.numbered =
      NumberedSpec{.prefix = "p", .from = 1, .to = 4, .access = Access::read_write, .source = "x"};
  Parameter torque = parameter("torque", 2);
  torque.encoding.scale = Decimal(1, -2);
  torque.unit = "torque";
  torque.range = {Decimal(0), Decimal(5)};
  torque.default_value = Decimal(100, -2);
  profile.parameters = {torque};
  return profile;
}

SnapshotEntry entry(const Profile& profile, const std::string& name, std::uint16_t raw) {
  const Parameter found = profile.find(name).value();
  return {.parameter = found,
          .raw = {raw},
          .value = decode(found, Registers{raw}).value(),
          .unit = found.unit == torque_unit ? "N.m" : found.unit,
          .minimum = decode(found, Registers{0}).value().number,
          .maximum = decode(found, Registers{1000}).value().number};
}

Snapshot snapshot(const Profile& profile,
                  const std::vector<std::pair<std::string, std::uint16_t>>& values) {
  Snapshot made;
  for (const auto& [name, raw] : values) made.entries.push_back(entry(profile, name, raw));
  return made;
}

Snapshot of_serial(Snapshot made, const std::string& serial) {
  made.identity = SnapshotIdentity{.serial = serial};
  return made;
}

std::vector<std::string> names_of(const std::vector<Parameter>& parameters) {
  std::vector<std::string> names;
  for (const Parameter& one : parameters) names.push_back(one.name);
  return names;
}

/// "name: a -> b", with "-" for what a side does not have.
std::vector<std::string> shown(const Comparison& comparison) {
  const auto side = [](const std::optional<Value>& value) {
    return value ? value->to_string() : std::string("-");
  };
  std::vector<std::string> lines;
  for (const Difference& one : comparison.differences) {
    lines.push_back(one.parameter.name + ": " + side(one.a) + " -> " + side(one.b));
  }
  return lines;
}

std::vector<std::string> shown(const RestorePlan& plan) {
  std::vector<std::string> lines;
  for (const PlannedWrite& write : plan.writes) {
    lines.push_back(write.parameter.name + ": " + write.before.to_string() + " -> " +
                    write.after.to_string());
  }
  return lines;
}

using Lines = std::vector<std::string>;

Selection select(const Lines& wanted, const Lines& ignored, const Profile& profile) {
  auto selection = Selection::make(wanted, ignored, profile);
  REQUIRE(selection.has_value());
  return *selection;
}

}  // namespace

TEST_CASE("the stored parameters of a numbered profile are its registers, each once, by name") {
  CHECK(names_of(stored_parameters(small_profile())) == Lines{"p1", "torque", "p3", "p4"});
  const Profile bm = test::bm_profile();
  const auto stored = stored_parameters(bm);
  REQUIRE(stored.size() == 725);
  for (std::size_t i = 0; i < stored.size(); ++i) {
    REQUIRE(stored[i].address.value == i + 1);
    REQUIRE(stored[i].table == modbus::RegisterTable::holding);
  }
  CHECK(stored[1].name == "preset.1.target-torque");
  CHECK(stored[724].name == "p725");
}

TEST_CASE("a pair of registers takes both numbers, and what overlaps is stored once") {
  Profile profile = small_profile();
  Parameter pair = parameter("pair", 3);
  pair.encoding.kind = Kind::u32;
  test::append(profile.parameters, pair);
  test::append(profile.parameters, parameter("torque.raw", 2));
  test::append(profile.parameters, parameter("elsewhere", 900));
  test::append(profile.parameters, parameter("shown.elsewhere", 901, Access::read_only));
  CHECK(names_of(stored_parameters(profile)) == Lines{"p1", "torque", "pair", "elsewhere"});
}

TEST_CASE("without numbers what can be set is stored in the order of the catalogue") {
  Profile profile;
  profile.parameters = {parameter("b", 20), parameter("a", 10, Access::read_only),
                        parameter("command", 30), parameter("c", 5)};
  profile.run = catalogue::RunSpec{.model = catalogue::CommandWordSpec{.command = "command"}};
  Parameter input = parameter("input", 5, Access::read_only);
  input.table = modbus::RegisterTable::input;
  test::append(profile.parameters, input);
  CHECK(names_of(stored_parameters(profile)) == Lines{"b", "c"});
}

TEST_CASE("the fingerprint depends on what is stored and not on where the file is") {
  Profile profile = small_profile();
  const std::string first = fingerprint(stored_parameters(profile));
  CHECK(first.size() == 16);
  profile.path = "/somewhere/else.yaml";
  profile.title = "another title";
  CHECK(fingerprint(stored_parameters(profile)) == first);
  test::edit(profile.parameters, 0,
             [](Parameter& changed) { changed.encoding.scale = Decimal(1, -1); });
  CHECK(fingerprint(stored_parameters(profile)) != first);
}

TEST_CASE("defaults are those that the profile knows") {
  const Snapshot defaults = snapshot_of_defaults(small_profile());
  REQUIRE(defaults.entries.size() == 1);
  CHECK(defaults.entries[0].parameter.name == "torque");
  CHECK(defaults.entries[0].raw == Registers{100});
}

TEST_CASE("a selection takes names, numbers and patterns, and refuses what does not exist") {
  const Profile profile = small_profile();
  const auto picked = [&](const Lines& wanted, const Lines& ignored) {
    const Selection selection = select(wanted, ignored, profile);
    Lines names;
    for (const Parameter& one : stored_parameters(profile)) {
      if (selection.contains(one)) names.push_back(one.name);
    }
    return names;
  };
  CHECK(picked({}, {}) == Lines{"p1", "torque", "p3", "p4"});
  CHECK(picked({"p*"}, {}) == Lines{"p1", "p3", "p4"});
  CHECK(picked({"p2"}, {}) == Lines{"torque"});
  CHECK(picked({}, {"p2", "p3"}) == Lines{"p1", "p4"});
  CHECK(picked({"torque", "p1"}, {"t*"}) == Lines{"p1"});
  for (const char* wrong : {"p9", "torqe", "x*", "@input:3"}) {
    CAPTURE(wrong);
    const auto selection = Selection::make({wrong}, {}, profile);
    REQUIRE_FALSE(selection.has_value());
    CHECK(selection.error().status() == ExitStatus::usage);
    CHECK_FALSE(Selection::make({}, {wrong}, profile).has_value());
  }
}

TEST_CASE("a comparison tells what differs and what only one side has") {
  const Profile profile = small_profile();
  const Snapshot a = snapshot(profile, {{"p1", 1}, {"torque", 271}, {"p3", 3}});
  Snapshot b = snapshot(profile, {{"p1", 1}, {"torque", 310}, {"p4", 4}});
  const Comparison comparison = compare(a, b, {});
  CHECK(comparison.same == 1);
  CHECK(shown(comparison) == Lines{"torque: 2.71 -> 3.10", "p3: 3 -> -", "p4: - -> 4"});
  CHECK(shown(compare(a, b, select({"p*"}, {"p3"}, profile))) == Lines{"p4: - -> 4"});
  CHECK(shown(compare(a, b, {}, Lacking::is_not_compared)) == Lines{"torque: 2.71 -> 3.10"});
  for (const auto& [why, count] :
       {std::pair(Missing::absent, 3), {Missing::unreadable, 2}, {Missing::left_out, 2}}) {
    b.missing = {{profile.find("p3").value(), why}};
    CHECK(compare(a, b, {}).differences.size() == static_cast<std::size_t>(count));
  }
}

TEST_CASE("a plan writes what differs in the order of the catalogue") {
  const Profile profile = small_profile();
  const Snapshot backup = snapshot(profile, {{"p3", 30}, {"torque", 200}, {"p1", 1}, {"p4", 9}});
  const Snapshot present = snapshot(profile, {{"p1", 1}, {"torque", 271}, {"p3", 3}});
  const RestorePlan plan = plan_restore(backup, present, profile, {}, Destination::same_tool);
  CHECK(shown(plan) == Lines{"torque: 2.71 -> 2.00", "p3: 3 -> 30"});
  CHECK(plan.count(Skip::equal) == 1);
  CHECK(plan.count(Skip::absent) == 1);
  CHECK(plan.findings.empty());
  CHECK(shown(plan_restore(backup, present, profile, select({"p3"}, {}, profile),
                           Destination::same_tool)) == Lines{"p3: 3 -> 30"});
}

TEST_CASE("what is read-only or belongs to one tool is skipped") {
  Profile profile = small_profile();
  Parameter shown_only = parameter("shown", 3, Access::read_only);
  Parameter address = parameter("address", 4);
  address.cloning = Cloning::never;
  test::append(profile.parameters, shown_only);
  test::append(profile.parameters, address);
  const Snapshot backup = snapshot(profile, {{"shown", 1}, {"address", 1}});
  const Snapshot present = snapshot(profile, {{"shown", 2}, {"address", 2}});
  const auto to_other = plan_restore(backup, present, profile, {}, Destination::other_tool);
  CHECK(to_other.writes.empty());
  CHECK(to_other.count(Skip::read_only) == 1);
  CHECK(to_other.count(Skip::not_cloned) == 1);
  const auto to_same = plan_restore(backup, present, profile, {}, Destination::same_tool);
  CHECK(shown(to_same) == Lines{"address: 2 -> 1"});
}

TEST_CASE("the same tool is one whose serial is known and the same") {
  const Profile profile = small_profile();
  const Snapshot plain = snapshot(profile, {});
  CHECK(destination_of(of_serial(plain, "7"), of_serial(plain, "7")) == Destination::same_tool);
  CHECK(destination_of(of_serial(plain, "7"), of_serial(plain, "8")) == Destination::other_tool);
  CHECK(destination_of(of_serial(plain, ""), of_serial(plain, "")) == Destination::other_tool);
  CHECK(destination_of(plain, plain) == Destination::other_tool);
}

TEST_CASE("every value that would be written is checked, and the limit that refuses is named") {
  const Profile profile = small_profile();
  const Snapshot present = snapshot(profile, {{"p1", 1}, {"torque", 271}, {"p3", 3}, {"p4", 4}});
  struct Row {
    const char* name;
    std::uint16_t raw;
    std::string message;
  };
  const Row rows[] = {
      {"p1", 1001, "1001 is above 1000, the maximum that the tool itself reports (register 201)"},
      {"torque", 600, "6.00 is above 5, the maximum of the profile"},
      {"p4", 65535, ""},  // the tool reports no limits of this one
      {"p3", 1000, ""},
  };
  for (const Row& row : rows) {
    CAPTURE(row.name);
    const auto plan = plan_restore(snapshot(profile, {{row.name, row.raw}}), present, profile, {},
                                   Destination::same_tool);
    REQUIRE(plan.findings.size() == (row.message.empty() ? 0U : 1U));
    if (row.message.empty()) continue;
    CHECK(message_of(plan.findings[0]) == row.message);
    CHECK(plan.findings[0].name == row.name);
    CHECK(plan.findings[0].status() == ExitStatus::usage);
  }
}

TEST_CASE("a value that the tool holds already is not refused") {
  const Profile profile = small_profile();
  Snapshot present = snapshot(profile, {{"torque", 600}});
  present.entries[0].maximum = Decimal(5);
  const auto plan = plan_restore(snapshot(profile, {{"torque", 600}}), present, profile, {},
                                 Destination::same_tool);
  CHECK(plan.findings.empty());
  CHECK(plan.writes.empty());
}

TEST_CASE("without the tool's own limits nothing is written where it should have them") {
  const Profile profile = small_profile();
  Snapshot present = snapshot(profile, {{"p1", 1}, {"p4", 4}});
  for (SnapshotEntry& one : present.entries) one.minimum.reset();
  const auto plan = plan_restore(snapshot(profile, {{"p1", 2}, {"p4", 5}}), present, profile, {},
                                 Destination::same_tool);
  REQUIRE(plan.findings.size() == 1);
  CHECK(plan.findings[0].name == "p1");
}

TEST_CASE("different and unknown units are never equal, whatever the numbers") {
  const Profile profile = small_profile();
  struct Row {
    std::string a;
    std::string b;
    const char* serial_of_b;
    Units units;
  };
  const Row rows[] = {
      {"N.m", "N.m", "8", Units::same}, {"N.m", "kgf.cm", "7", Units::different},
      {"N.m", "", "7", Units::unknown}, {"", "N.m", "8", Units::unknown},
      {"", "", "8", Units::unknown},    {"", "", "7", Units::same},
  };
  for (const Row& row : rows) {
    CAPTURE(row.a);
    CAPTURE(row.b);
    Snapshot a = of_serial(snapshot(profile, {{"torque", 271}, {"p1", 1}}), "7");
    Snapshot b = of_serial(snapshot(profile, {{"torque", 271}, {"p1", 1}}), row.serial_of_b);
    a.entries[0].unit = row.a;
    b.entries[0].unit = row.b;
    const bool same = row.units == Units::same;
    const Comparison comparison = compare(a, b, {});
    CHECK(comparison.same == (same ? 2U : 1U));
    REQUIRE(comparison.differences.size() == (same ? 0U : 1U));
    if (!same) {
      CHECK(comparison.differences[0].units == row.units);
      CHECK(comparison.differences[0].unit_a == row.a);
      CHECK(comparison.differences[0].unit_b == row.b);
    }
    const RestorePlan plan = plan_restore(a, b, profile, {}, destination_of(a, b));
    REQUIRE(plan.findings.size() == (same ? 0U : 1U));
    if (!same) CHECK(plan.findings[0].status() == ExitStatus::mismatch);
    CHECK(plan.count(Skip::equal) == (same ? 2U : 1U));
  }
}

TEST_CASE("with another unit a number is written only when that is asked for") {
  const Profile profile = small_profile();
  Snapshot backup = snapshot(profile, {{"torque", 271}});
  Snapshot present = snapshot(profile, {{"torque", 310}});
  present.entries[0].unit = "kgf.cm";
  const auto strict = plan_restore(backup, present, profile, {}, Destination::same_tool);
  REQUIRE(strict.findings.size() == 1);
  CHECK(message_of(strict.findings[0]) ==
        "the backup has 2.71 N.m, and this tool holds 3.10 kgf.cm");
  const auto forced =
      plan_restore(backup, present, profile, {}, Destination::same_tool, UnitRule::ignored);
  CHECK(forced.findings.empty());
  CHECK(shown(forced) == Lines{"torque: 3.10 -> 2.71"});
}

TEST_CASE("a pair that cannot be written is told before anything is") {
  Profile profile = small_profile();
  profile.numbered.reset();
  profile.limits.reset();
  Parameter wide = parameter("wide", 10);
  wide.encoding.kind = Kind::u32;
  test::append(profile.parameters, wide);
  profile.link.max_write = 1;
  Snapshot backup;
  backup.entries.push_back(
      {.parameter = wide, .raw = {1, 0}, .value = decode(wide, Registers{1, 0}).value()});
  Snapshot present = backup;
  present.entries[0].value = decode(wide, Registers{0, 1}).value();
  const auto plan = [&] {
    return plan_restore(backup, present, profile, {}, Destination::same_tool);
  };
  CHECK(plan().findings.empty());
  profile.link.even_pairs = true;
  REQUIRE(plan().findings.size() == 1);
  CHECK(plan().findings[0].status() == ExitStatus::usage);
}

namespace {

/// A power that is counted in steps of 10^exponent W.
Profile power_profile(Access of_exponent = Access::read_write) {
  Profile profile;
  profile.id = "power";
  Parameter power = parameter("power", 10);
  power.unit = "W";
  power.scale_by = "exponent";
  power.range = {Decimal(0), Decimal(9000)};
  Parameter exponent = parameter("exponent", 11, of_exponent);
  exponent.encoding.kind = Kind::i16;
  profile.parameters = {power, exponent};
  return profile;
}

/// What a tool holds, or a backup has of it.
Snapshot power_snapshot(const Profile& profile, std::uint16_t raw, int exponent) {
  Snapshot made;
  const Parameter power = with_power(profile.find("power").value(), exponent);
  made.entries.push_back({.parameter = power,
                          .raw = {raw},
                          .value = decode(power, Registers{raw}).value(),
                          .unit = "W",
                          .step = power.encoding.scale});
  const Parameter decider = profile.find("exponent").value();
  if (decider.access == Access::read_only) return made;
  const auto word = static_cast<std::uint16_t>(exponent);
  made.entries.push_back(
      {.parameter = decider, .raw = {word}, .value = decode(decider, Registers{word}).value()});
  return made;
}

std::vector<std::uint16_t> words(const RestorePlan& plan) {
  std::vector<std::uint16_t> all;
  for (const PlannedWrite& write : plan.writes) {
    all.push_back(encode(write.parameter, write.after).value().front());
  }
  return all;
}

using Words = std::vector<std::uint16_t>;

}  // namespace

TEST_CASE("steps are restored behind what says what they are worth") {
  const Profile profile = power_profile();
  const auto plan = plan_restore(power_snapshot(profile, 50, 2), power_snapshot(profile, 7, 0),
                                 profile, {}, Destination::other_tool);
  CHECK(plan.findings.empty());
  CHECK(shown(plan) == Lines{"exponent: 0 -> 2", "power: 700 -> 5000"});
  CHECK(words(plan) == Words{2, 50});
  CHECK(plan.writes[1].needs == "exponent");
  // As many steps of another worth are right once they are worth the same.
  const auto steps = plan_restore(power_snapshot(profile, 50, 2), power_snapshot(profile, 50, 0),
                                  profile, {}, Destination::other_tool);
  CHECK(shown(steps) == Lines{"exponent: 0 -> 2"});
  CHECK(steps.count(Skip::equal) == 1);
}

TEST_CASE("where the worth of a step stays another one, the quantity is counted anew or refused") {
  for (const Access access : {Access::read_write, Access::read_only}) {
    const Profile profile = power_profile(access);
    const Selection power = select({"power"}, {}, profile);
    const auto plan = plan_restore(power_snapshot(profile, 50, 2), power_snapshot(profile, 7, 0),
                                   profile, power, Destination::other_tool, UnitRule::ignored);
    CHECK(plan.findings.empty());
    CHECK(shown(plan) == Lines{"power: 7 -> 5000"});
    CHECK(words(plan) == Words{5000});

    const auto between = plan_restore(power_snapshot(profile, 50, 2), power_snapshot(profile, 7, 3),
                                      profile, power, Destination::other_tool);
    CHECK(words(between) == Words{5});
    const auto refused = plan_restore(power_snapshot(profile, 55, 2), power_snapshot(profile, 7, 3),
                                      profile, power, Destination::other_tool, UnitRule::ignored);
    CHECK(refused.writes.empty());
    REQUIRE(refused.findings.size() == 1);
    CHECK(refused.findings[0].message ==
          "the backup has 5500 W in steps of 100, and this tool counts in steps of 1000, as "
          "exponent says, which cannot hold it");
    // The range is that of the quantity.
    const auto beyond = plan_restore(power_snapshot(profile, 91, 2), power_snapshot(profile, 7, 2),
                                     profile, power, Destination::other_tool);
    REQUIRE(beyond.findings.size() == 1);
    CHECK(beyond.findings[0].code == Errc::out_of_range);
  }
}

TEST_CASE("steps of a worth that is not known are only restored with what says it") {
  const Profile profile = power_profile();
  Snapshot backup = power_snapshot(profile, 50, 2);
  backup.entries[0].step.reset();
  const Snapshot present = power_snapshot(profile, 7, 0);
  const auto refused = plan_restore(backup, present, profile, select({"power"}, {}, profile),
                                    Destination::same_tool);
  CHECK(refused.writes.empty());
  CHECK(refused.findings.size() == 1);
  CHECK(words(plan_restore(backup, present, profile, {}, Destination::same_tool)) == Words{2, 50});
}

TEST_CASE("an entry is read anew once the worth of its steps was written") {
  const Profile profile = power_profile();
  const auto plan = plan_restore(power_snapshot(profile, 7, 2), power_snapshot(profile, 7, 0),
                                 profile, {}, Destination::other_tool);
  REQUIRE(plan.writes.size() == 1);
  const SnapshotEntry entry = power_snapshot(profile, 7, 0).entries[0];
  const auto then = with_step_of(entry, profile.find("power").value(), plan.writes[0]);
  CHECK(then.value.to_string() == "700");
  CHECK(then.step == Decimal(100));
  CHECK(with_step_of(entry, profile.find("exponent").value(), plan.writes[0]).value == entry.value);
}

TEST_CASE("values that are one number in 64 bits are told apart by their registers") {
  Profile profile;
  Parameter charge = parameter("charge", 0);
  charge.encoding = {.kind = Kind::u64, .scale = Decimal(20), .divisor = 32768};
  profile.parameters = {charge};
  const auto holding = [&](const Registers& raw) {
    Snapshot made;
    made.entries.push_back({.parameter = charge, .raw = raw, .value = decode(charge, raw).value()});
    return made;
  };
  const Snapshot backup = holding({0xFFFF, 0xFFFF, 0xFFFF, 0xFFFE});
  const Snapshot present = holding({0xFFFF, 0xFFFF, 0xFFFF, 0xFFFF});
  REQUIRE(backup.entries[0].value.number == present.entries[0].value.number);
  CHECK(compare(backup, present, {}).differences.size() == 1);
  CHECK(compare(backup, backup, {}).differences.empty());
  const auto plan = plan_restore(backup, present, profile, {}, Destination::same_tool);
  REQUIRE(plan.writes.size() == 1);
  CHECK(*encode(charge, plan.writes[0].after) == backup.entries[0].raw);
}

TEST_CASE("what is guarded is restored before all others") {
  Profile profile;
  profile.id = "guarded";
  Parameter unit = parameter("unit", 3);
  unit.guarding = Guarding::alone;
  profile.parameters = {parameter("first", 1), parameter("second", 2), unit};
  const auto backup = snapshot(profile, {{"first", 1}, {"second", 2}, {"unit", 3}});
  const auto present = snapshot(profile, {{"first", 0}, {"second", 0}, {"unit", 0}});
  const auto plan = plan_restore(backup, present, profile, {}, Destination::same_tool);
  CHECK(shown(plan) == Lines{"unit: 0 -> 3", "first: 0 -> 1", "second: 0 -> 2"});
}
