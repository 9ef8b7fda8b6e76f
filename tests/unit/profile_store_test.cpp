#include "spindle/files/profile_store.hpp"

#include <doctest/doctest.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <set>
#include <string>
#include <vector>

#include "spindle/base/text.hpp"
#include "spindle/catalogue/identity.hpp"
#include "spindle/posix/disk.hpp"
#include "support/temporary_folder.hpp"

using namespace spindle;
using catalogue::Access;
using catalogue::Evidence;
using catalogue::Hazard;
using catalogue::Parameter;
using catalogue::Profile;
using files::Diagnostic;
using files::ProfileStore;

namespace {

const std::string shipped_folder = SPINDLE_SOURCE_DIR "/profiles";
const std::string bad_folder = SPINDLE_SOURCE_DIR "/tests/profiles/bad";

ProfileStore shipped() { return ProfileStore({shipped_folder}, posix::source_disk()); }

Profile load(std::string_view name) {
  auto profile = shipped().load(name);
  REQUIRE_MESSAGE(profile.has_value(), describe(profile.error()));
  return *std::move(profile);
}

Parameter parameter(const Profile& profile, std::string_view name) {
  const auto found = profile.find(name);
  REQUIRE_MESSAGE(found.has_value(), describe(found.error()));
  return *found;
}

using Folder = test::TemporaryFolder;

/// The lines "# expect: LINE:COLUMN: text" at the top of a rejected file.
std::vector<std::string> expectations(const std::string& path) {
  const std::string mark = "# expect: ";
  std::vector<std::string> expected;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line) && line.starts_with(mark);) {
    expected.push_back(line.substr(mark.size()));
  }
  return expected;
}

std::string without_file(const Diagnostic& finding) {
  return finding.to_string().substr(finding.file.size() + 1);
}

std::vector<std::string> bad_files() {
  std::vector<std::string> paths;
  for (const auto& entry : std::filesystem::directory_iterator(bad_folder)) {
    paths.push_back(entry.path().string());
  }
  std::sort(paths.begin(), paths.end());
  return paths;
}

/// The profile of the architecture's section 5, as users write their own.
constexpr const char* own_profile = R"YAML(format: 1
id: my-bm
title: "DOGA BM wireless screwdriver (Modbus TCP, firmware below 4000)"
extends: doga-common            # a user's own profile extends ours in the same way
link:    {framing: tcp, port: 5000, unit: 0, transaction: echoed, max-read: 100, keep-alive: 1s, answer: 1s}
events:  {arm: {register: 4002, value: 1, every: 5s, expires: 10s}, function: 4, first: 3200, count: 14, number: event.number, kind: event.status}
limits:  {minimum-offset: 1000, maximum-offset: 2000, from: 1, to: 724}
numbered: {prefix: p, table: holding, from: 1, to: 725}
exceptions: {0x0E: "range of data not available"}
parameters:
  - {name: "preset.{n}.target-torque", n: 1..15, register: 2, stride: 15, encoding: u16, scale: 0.01, unit: torque, access: rw, evidence: manual, source: "60427 §3.1", title: "Target torque"}
actions:
  - {name: start, register: 4003, value: 1, stop: 0, hazard: moves, evidence: sibling, source: "ADC controller manual", confirm: status.running}
)YAML";

}  // namespace

TEST_CASE("every shipped profile is free of findings, bases included") {
  int checked = 0;
  for (const auto& entry : std::filesystem::directory_iterator(shipped_folder)) {
    const std::string path = entry.path().string();
    CAPTURE(path);
    const auto findings = shipped().check(path);
    REQUIRE(findings.has_value());
    for (const Diagnostic& finding : *findings) FAIL_CHECK(finding.to_string());
    ++checked;
  }
  CHECK(checked >= 3);
}

TEST_CASE("a drive with one command register is described without a fault") {
  for (const char* name : {"fc01-vfd", "held-drive"}) {
    CAPTURE(name);
    const std::string path =
        fmt::format("{}/tests/profiles/good/{}.yaml", SPINDLE_SOURCE_DIR, name);
    const auto findings = shipped().check(path);
    REQUIRE(findings.has_value());
    for (const Diagnostic& finding : *findings) FAIL_CHECK(finding.to_string());
    const auto profile = shipped().load(path);
    REQUIRE(profile);
    REQUIRE(profile->run);
    CHECK(profile->run->kind() == catalogue::RunKind::command_register);
    CHECK(profile->commands_motion(profile->find("command").value()));
  }
}

TEST_CASE("a profile of another run model than its base has nothing of the base's") {
  const Folder folder;
  const std::string path = folder.write(
      "mine.yaml",
      "format: 1\nid: mine\ntitle: T\nextends: fc01-vfd\n"
      "run: {model: start-action, start: go}\nactions:\n"
      "  - {name: go, register: 30, value: 1, stop: 0, confirm: status, hazard: moves, evidence: "
      "manual, source: S}\n");
  const ProfileStore store({SPINDLE_SOURCE_DIR "/tests/profiles/good"}, posix::source_disk());
  const auto profile = store.load(path);
  REQUIRE_MESSAGE(profile.has_value(), describe(profile.error()));
  CHECK(profile->run->command_register() == nullptr);
  REQUIRE(profile->run->action() != nullptr);
  CHECK(profile->run->action()->start == "go");
  CHECK(profile->run->source.find("grblHAL") != std::string::npos);
  CHECK_FALSE(profile->commands_motion(profile->find("command").value()));
  CHECK(profile->is_guarded_start("go"));
}

TEST_CASE("every rejected profile is refused for its own reason, at its place") {
  const std::vector<std::string> paths = bad_files();
  CHECK(paths.size() > 100);
  for (const std::string& path : paths) {
    CAPTURE(path);
    const std::vector<std::string> expected = expectations(path);
    REQUIRE_FALSE(expected.empty());
    const auto findings = shipped().check(path);
    REQUIRE(findings.has_value());
    std::vector<std::string> found;
    for (const Diagnostic& finding : *findings) found.push_back(without_file(finding));
    REQUIRE(found.size() == expected.size());
    for (std::size_t i = 0; i < expected.size(); ++i) {
      CAPTURE(found[i]);
      CHECK(found[i].starts_with(expected[i]));
    }
  }
}

TEST_CASE("loading a rejected profile is bad_file with the first finding") {
  for (const std::string& path : bad_files()) {
    // Documents behind the first are not read by load().
    const std::string stem = std::filesystem::path(path).stem().string();
    if (stem.starts_with("part-") || stem.starts_with("simulation-")) continue;
    CAPTURE(path);
    const auto profile = shipped().load(path);
    REQUIRE_FALSE(profile.has_value());
    CHECK(profile.error().code == Errc::bad_file);
    CHECK(profile.error().message.starts_with(path + ":" + expectations(path).front()));
  }
}

TEST_CASE("several faults are all reported, in the order of the file") {
  const Folder folder;
  const std::string path = folder.write("many.yaml",
                                        "format: 1\n"
                                        "id: many\n"
                                        "title: Many\n"
                                        "titel: x\n"
                                        "link: {framing: tcp, port: 70000}\n"
                                        "parameters:\n"
                                        "  - {name: a, register: 1, encoding: u17}\n");
  const auto findings = shipped().check(path);
  REQUIRE(findings.has_value());
  std::vector<std::string> found;
  for (const Diagnostic& finding : *findings) found.push_back(without_file(finding));
  CHECK(found == std::vector<std::string>{
                     "4:1: unknown key 'titel'; did you mean 'title'?",
                     "5:28: '70000' is not a whole number from 0 to 65535",
                     "7:5: key 'title' is missing",
                     "7:5: key 'access' is missing",
                     "7:5: key 'evidence' is missing",
                     "7:5: key 'source' is missing",
                     "7:38: unknown encoding 'u17'; known: u16, i16, u32, i32, u64, i64, u8, i8, "
                     "f32, f64, bcd, text, bit, date",
                 });
  const auto profile = shipped().load(path);
  REQUIRE_FALSE(profile.has_value());
  CHECK(profile.error().message.ends_with("(and 6 more faults)"));
  CHECK(profile.error().hint == "'spindle profile check " + path + "' lists every fault");
}

TEST_CASE("rules are checked too where other entries could not be read, and find no false faults") {
  const Folder folder;
  const std::string path = folder.write(
      "many.yaml",
      "format: 1\n"
      "id: other\n"
      "title: Many\n"
      "link: {framing: tcp, max-read: 200}\n"
      "parameters:\n"
      "  - {name: a, register: 5, encoding: u17, access: r, title: T, evidence: manual, source: "
      "m}\n"
      "  - {name: b, register: 1, encoding: u16, access: r, title: T, evidence: manual, source: "
      "m}\n"
      "  - {name: c, register: 1, encoding: u16, access: r, title: T, evidence: manual, source: "
      "m}\n"
      "  - {name: d, encoding: u16, access: r, title: T, evidence: manual, source: m}\n"
      "  - {name: e, register: 0, encoding: u16, access: r, title: T, evidence: manual, source: "
      "m}\n"
      "actions:\n"
      "  - {name: go, register: 9, value: 1, stop: 0, hazard: moves, evidence: manual, source: m, "
      "confirm: a}\n"
      "  - {name: to, register: 8, value: 1, hazard: locks, evidence: manual, source: m, confirm: "
      "x}\n"
      "  - {name: up, register: 8, value: 1, hazard: locks, evidence: hearsay, source: m}\n"
      "watch: [a, b]\n"
      "---\n"
      "part: simulation\n"
      "values: {a: 1}\n"
      "---\n"
      "part: nonsense\n");
  const auto findings = shipped().check(path);
  REQUIRE(findings.has_value());
  std::vector<std::string> found;
  for (const Diagnostic& finding : *findings) found.push_back(without_file(finding));
  CHECK(found ==
        std::vector<std::string>{
            "2:5: id 'other' differs from the file name 'many'",
            "4:32: max-read must be 1 to 125",
            "6:38: unknown encoding 'u17'; known: u16, i16, u32, i32, u64, i64, u8, i8, f32, f64, "
            "bcd, text, bit, date",
            "8:25: c shares register 1 with b; write 'overlaps: true' if this is meant",
            "9:5: key 'register' is missing",
            "12:56: go: it moves, and no 'run' of this profile guards it",
            "13:92: 'x' is no parameter of this profile; did you mean 'b'?",
            "14:64: unknown evidence 'hearsay'; known: verified, manual, transcribed, sibling, "
            "inferred",
            "20:7: unknown part 'nonsense'; known: texts, simulation",
        });
}

TEST_CASE("a base that is not found hides no fault of the file itself") {
  const Folder folder;
  const auto findings = shipped().check(
      folder.write("mine.yaml",
                   "format: 1\nid: other\ntitle: Mine\nextends: doga-bn\nlink: {port: 502}\n"
                   "watch: [event.number]\n"));
  REQUIRE(findings.has_value());
  std::vector<std::string> found;
  for (const Diagnostic& finding : *findings) found.push_back(without_file(finding));
  CHECK(found == std::vector<std::string>{"2:5: id 'other' differs from the file name 'mine'",
                                          "4:10: base profile 'doga-bn' is not found"});
}

// ---- finding profiles ----

TEST_CASE("list() names products, not bases, and the first folder wins") {
  const Folder folder;
  const std::string path = folder.write("doga-bm.yaml", "format: 1\n");
  folder.write("notes.txt", "");
  const std::vector<files::ProfileEntry> entries =
      ProfileStore({folder.path(), shipped_folder, "/no/such/folder"}, posix::source_disk()).list();
  std::vector<std::string> ids;
  for (const auto& entry : entries) ids.push_back(entry.id);
  CHECK(std::is_sorted(ids.begin(), ids.end()));
  CHECK(std::count(ids.begin(), ids.end(), "doga-bm") == 1);
  CHECK(std::count(ids.begin(), ids.end(), "doga-bmt") == 1);
  CHECK(std::count(ids.begin(), ids.end(), "doga-common") == 0);
  CHECK(entries.front().path == path);
}

TEST_CASE("a profile that is not there") {
  const auto misspelt = shipped().load("doga-mb");
  REQUIRE_FALSE(misspelt.has_value());
  CHECK(misspelt.error().code == Errc::unknown_name);
  CHECK(describe(misspelt.error()) == "doga-mb: no such profile; did you mean 'doga-bm'?");

  const auto no_file = shipped().load("./no-such.yaml");
  REQUIRE_FALSE(no_file.has_value());
  CHECK(no_file.error().code == Errc::bad_file);
  CHECK(no_file.error().message == "no such file");

  const auto folder = shipped().load("/tmp/");
  REQUIRE_FALSE(folder.has_value());
  CHECK(folder.error().message == "is a folder, not a file");

  const auto base = shipped().load("doga-common");
  REQUIRE_FALSE(base.has_value());
  CHECK(base.error().message == "is only a base for other profiles");
}

TEST_CASE("a file larger than any profile is refused") {
  const Folder folder;
  const std::string path = folder.write("large.yaml", "#" + std::string(1 << 20, 'x') + "\n");
  const auto profile = shipped().load(path);
  REQUIRE_FALSE(profile.has_value());
  CHECK(profile.error().code == Errc::bad_file);
  CHECK(profile.error().message.starts_with("larger than 1048576 bytes"));
}

TEST_CASE("an empty file is a finding") {
  const Folder folder;
  const auto findings = shipped().check(folder.write("empty.yaml", ""));
  REQUIRE(findings.has_value());
  REQUIRE(findings->size() == 1);
  CHECK(without_file(findings->front()) == "1:1: the file is empty");
}

// ---- extends ----

TEST_CASE("a user's own profile extends ours, wherever it lies") {
  const Folder folder;
  const std::string path = folder.write("my-bm.yaml", own_profile);
  const auto own = shipped().load(path);
  REQUIRE_MESSAGE(own.has_value(), describe(own.error()));
  const Profile& profile = *own;
  const Profile ours = load("doga-bm");
  CHECK(profile.id == "my-bm");
  CHECK(profile.maker == "DOGA / HANTAS");
  CHECK(profile.path == path);
  CHECK(profile.parameters.size() == ours.parameters.size());
  CHECK(parameter(profile, "preset.7.target-torque").evidence == Evidence::manual);
  CHECK(parameter(ours, "preset.7.target-torque").evidence == Evidence::inferred);
  CHECK(profile.actions.size() == ours.actions.size());
  CHECK(profile.exceptions.at(0x0E).text == "range of data not available");
  CHECK(profile.exceptions.at(0x02).text == "wrong address, or no such address");
  CHECK(profile.numbered->evidence == Evidence::manual);  // what the child leaves out stays
  CHECK(profile.events->kinds.at(1) == catalogue::EventKind::fastening_ok);
  CHECK(shipped().load_simulation(path).value().values.empty());
}

TEST_CASE("scalar keys override one by one; entries of the same name replace, others are added") {
  const Folder folder;
  const std::string path = folder.write(
      "mine.yaml",
      "format: 1\nid: mine\ntitle: Mine\nextends: doga-bm\n"
      "link: {port: 502}\n"
      "identity: {models: {12: \"3300\"}}\n"
      "parameters:\n"
      "  - {name: preset.1.speed, register: 8, encoding: u16, unit: rpm, range: 50..1200, access: "
      "rw, evidence: transcribed, source: \"datasheet\", title: \"Speed\"}\n"
      "  - {name: buzzer, register: 401, encoding: u16, labels: {0: \"off\", 1: \"on\"}, default: "
      "1, access: rw, evidence: transcribed, source: \"datasheet\", title: \"Buzzer\"}\n");
  const auto own = shipped().load(path);
  REQUIRE_MESSAGE(own.has_value(), describe(own.error()));
  CHECK(own->series == "BM");
  CHECK(own->link.port == 502);
  CHECK(own->link.max_read == 100);
  CHECK(own->identity->models.at(12) == "3300");
  CHECK(own->identity->models.at(3) == "3204");
  CHECK(own->parameters.size() == load("doga-bm").parameters.size() + 1);
  CHECK(parameter(*own, "preset.1.speed").range.maximum == Decimal(1200));
  CHECK(own->parameters.back().name == "buzzer");
  CHECK(own->parameters.back().default_value == Decimal(1));
  CHECK(shipped().load_simulation(path).has_value());  // the nearest base's
  CHECK(shipped().load_error_codes(path)->size() == 27);
}

TEST_CASE("a base beside the file comes before that of the store") {
  const Folder folder;
  folder.write("doga-common.yaml",
               "format: 1\nid: doga-common\ntitle: Mine\nabstract: true\nmaker: Other\n"
               "link: {framing: rtu}\n");
  const std::string path =
      folder.write("mine.yaml", "format: 1\nid: mine\ntitle: Mine\nextends: doga-common\n");
  const auto own = shipped().load(path);
  REQUIRE_MESSAGE(own.has_value(), describe(own.error()));
  CHECK(own->maker == "Other");
  CHECK(own->link.framing == modbus::Framing::rtu);
}

TEST_CASE("bases that go round in circles, or on and on, are findings") {
  const Folder folder;
  folder.write("one.yaml", "format: 1\nid: one\ntitle: One\nextends: two\n");
  folder.write("two.yaml", "format: 1\nid: two\ntitle: Two\nextends: one\n");
  const auto circle = ProfileStore({folder.path()}, posix::source_disk()).load("one");
  REQUIRE_FALSE(circle.has_value());
  CHECK(circle.error().message ==
        folder.path() + "/two.yaml:4:10: 'one' extends itself in the end");

  for (int i = 0; i < 9; ++i) {
    const std::string id = "level" + std::to_string(i);
    folder.write(id + ".yaml", "format: 1\nid: " + id + "\ntitle: Level\nextends: level" +
                                   std::to_string(i + 1) + "\n");
  }
  const auto chain = ProfileStore({folder.path()}, posix::source_disk()).load("level0");
  REQUIRE_FALSE(chain.has_value());
  CHECK(chain.error().message ==
        folder.path() + "/level7.yaml:4:10: more than 8 profiles extend each other");
}

TEST_CASE("a fault of the base is told with the base's name") {
  const Folder folder;
  folder.write("base.yaml", "format: 1\nid: base\ntitle: Base\nmakr: x\nlink: {framing: tcp}\n");
  const auto own = shipped().load(
      folder.write("mine.yaml", "format: 1\nid: mine\ntitle: Mine\nextends: base\n"));
  REQUIRE_FALSE(own.has_value());
  CHECK(own.error().message ==
        folder.path() + "/base.yaml:4:1: unknown key 'makr'; did you mean 'maker'?");
}

// ---- a serial product, as a profile can describe it ----

TEST_CASE("serial facts, 32-bit pairs and hexadecimal registers") {
  const Folder folder;
  const std::string path = folder.write(
      "drive.yaml",
      "format: 1\nid: drive\ntitle: Drive\n"
      "link:\n"
      "  framing: rtu\n"
      "  unit: 1\n"
      "  max-read: 16\n"
      "  max-write: 16\n"
      "  pairs: even\n"
      "  loopback: true\n"
      "  answer: 500ms\n"
      "  serial: {baud: 9600, parity: even, stop: 1, gaps: [{up-to: 19200, gap: 5.5ms}, {gap: "
      "3.5ms}], broadcast-pause: 5ms}\n"
      "parameters:\n"
      "  - {name: \"operation.{n}.speed\", n: 0..7, register: 0x0480, stride: 2, encoding: i32, "
      "unit: rpm, range: 0..4000, default: 010, access: rw, evidence: manual, source: S, title: "
      "\"Speed of operation data {n}\"}\n");
  const auto drive = shipped().load(path);
  REQUIRE_MESSAGE(drive.has_value(), describe(drive.error()));
  CHECK(drive->link.framing == modbus::Framing::rtu);
  CHECK(drive->link.even_pairs);
  CHECK(drive->link.loopback);
  CHECK(drive->link.max_write == 16);
  CHECK(drive->link.answer == std::chrono::milliseconds(500));
  CHECK(drive->link.serial.line.parity == modbus::Parity::even);
  REQUIRE(drive->link.serial.gaps.size() == 2);
  CHECK(drive->link.serial.gaps[0].up_to_baud == 19200);
  CHECK(drive->link.serial.gaps[0].gap == std::chrono::microseconds(5500));
  CHECK(drive->link.serial.gaps[1].up_to_baud == 0);
  const Parameter speed = parameter(*drive, "operation.7.speed");
  CHECK(speed.address.value == 0x048E);
  CHECK(speed.title == "Speed of operation data 7");
  CHECK(speed.default_value == Decimal(10));  // "010" is ten
  CHECK_FALSE(drive->identity.has_value());
  const auto simulation = shipped().load_simulation(path);
  REQUIRE(simulation.has_value());
  CHECK(simulation->values.empty());
}

// ---- what the shipped DOGA profiles say ----

TEST_CASE("doga-bm: counts") {
  const Profile profile = load("doga-bm");
  const auto count = [&](std::string_view pattern) {
    const auto found = profile.select({std::string(pattern)});
    return found ? found->size() : 0;
  };
  CHECK(count("preset.*") == 225);
  CHECK(count("event.*") == 14);
  CHECK(count("status.*") == 14);
  CHECK(count("alarm.*") == 2);
  CHECK(profile.parameters.size() == 261);
  CHECK(profile.actions.size() == 6);
  CHECK(profile.exceptions.size() == 6);
}

TEST_CASE("doga-bm: registers, scales and evidence (protocol notes, sections 2 and 5)") {
  struct Row {
    const char* name;
    std::uint16_t address;
    const char* scale;
    const char* unit;
    Access access;
    Evidence evidence;
  };
  const std::vector<Row> rows = {
      {"preset.1.mode", 1, "1", "", Access::read_write, Evidence::sibling},
      {"preset.1.target-torque", 2, "0.01", "torque", Access::read_write, Evidence::manual},
      {"preset.1.torque-limit", 3, "0.01", "%", Access::read_write, Evidence::manual},
      {"preset.1.torque-compensation", 15, "1", "%", Access::read_write, Evidence::sibling},
      {"preset.2.target-torque", 17, "0.01", "torque", Access::read_write, Evidence::inferred},
      {"preset.15.torque-compensation", 225, "1", "%", Access::read_write, Evidence::inferred},
      {"event.number", 3200, "1", "", Access::read_only, Evidence::sibling},
      {"event.fastening-time", 3201, "1", "ms", Access::read_only, Evidence::sibling},
      {"event.torque", 3204, "0.01", "torque", Access::read_only, Evidence::manual},
      {"event.snug-angle", 3213, "1", "deg", Access::read_only, Evidence::manual},
      {"status.torque", 3300, "0.01", "torque", Access::read_only, Evidence::inferred},
      {"status.current", 3302, "1", "", Access::read_only, Evidence::sibling},
      {"status.temperature", 3313, "1", "degC", Access::read_only, Evidence::sibling},
      {"alarm.1", 3100, "1", "", Access::read_only, Evidence::manual},
      {"alarm.2", 3101, "1", "", Access::read_only, Evidence::manual},
      {"p725", 725, "1", "", Access::read_write, Evidence::manual},
  };
  const Profile profile = load("doga-bm");
  for (const Row& row : rows) {
    CAPTURE(row.name);
    const Parameter found = parameter(profile, row.name);
    CHECK(found.address.value == row.address);
    CHECK(found.encoding.scale == *Decimal::parse(row.scale));
    CHECK(found.unit == row.unit);
    CHECK(found.access == row.access);
    CHECK(found.evidence == row.evidence);
    CHECK_FALSE(found.source.empty());
    CHECK_FALSE(found.title.empty());
  }
  CHECK(parameter(profile, "event.torque").encoding.kind == catalogue::Kind::i16);
  CHECK(parameter(profile, "status.torque").encoding.kind == catalogue::Kind::i16);
}

TEST_CASE("doga-bm: actions weaker than the manual say how to verify them") {
  struct Row {
    const char* name;
    std::uint16_t address;
    Hazard hazard;
    Evidence evidence;
    const char* confirm;
  };
  const std::vector<Row> rows = {
      {"alarm-reset", 4000, Hazard::unclear, Evidence::sibling, "status.alarm"},
      {"lock", 4001, Hazard::locks, Evidence::inferred, ""},
      {"auto-output", 4002, Hazard::none, Evidence::manual, ""},
      {"start", 4003, Hazard::moves, Evidence::sibling, "status.running"},
      {"select-preset", 4004, Hazard::unclear, Evidence::sibling, "status.preset"},
      {"direction", 4005, Hazard::unclear, Evidence::sibling, "status.direction"},
  };
  const Profile profile = load("doga-bm");
  for (const Row& row : rows) {
    CAPTURE(row.name);
    const auto action = profile.find_action(row.name);
    REQUIRE(action.has_value());
    CHECK(action->address.value == row.address);
    CHECK(action->hazard == row.hazard);
    CHECK(action->evidence == row.evidence);
    CHECK(action->confirm == row.confirm);
    CHECK(action->check.empty() == (row.evidence == Evidence::manual));
    CHECK_FALSE(
        profile.writable(modbus::RegisterTable::holding, action->address));  // raw writes stay away
  }
  CHECK(profile.find_action("alarm-reset")->confirm_value == 0);
  CHECK(profile.find_action("start")->stop_value == 0);
  CHECK(profile.find_action("select-preset")->maximum == 15);
  CHECK_FALSE(profile.find_action("select-preset")->value.has_value());
}

TEST_CASE("doga-bm: link, events, limits") {
  const Profile profile = load("doga-bm");
  CHECK(profile.link.port == 5000);
  CHECK(profile.link.unit == 0);
  CHECK(profile.link.max_read == 100);
  CHECK(profile.link.keep_alive == std::chrono::seconds(1));
  CHECK(profile.link.contiguous.size() == 6);
  REQUIRE(profile.link.absent.size() == 3);
  CHECK(profile.link.absent.front().from == 564);
  CHECK(profile.link.absent.front().note == "60427 §3.5");
  REQUIRE(profile.events.has_value());
  CHECK(profile.events->arm->address == 4002);
  CHECK(profile.events->arm->every == std::chrono::seconds(5));
  CHECK(profile.events->arm->expires == std::chrono::seconds(10));
  CHECK(profile.events->count == 14);
  CHECK(profile.events->kinds.size() == 9);
  REQUIRE(profile.limits.has_value());
  CHECK(profile.limits->to == 724);
}

TEST_CASE("models: 3280 is a BMT only (60427 §3.4)") {
  CHECK_FALSE(load("doga-bm").identity->models.contains(11));
  CHECK(load("doga-bmt").identity->models.at(11) == "3280");
  CHECK(load("doga-bmt").identity->models.at(10) == "3264");
  CHECK(load("doga-bm").identity->products.at(29) == "doga-bmt");
}

TEST_CASE("error codes come with texts, and NG codes of the manual are all there") {
  const auto codes = shipped().load_error_codes("doga-bm");
  REQUIRE(codes.has_value());
  CHECK(codes->at(332).text == "angle above the maximum");
  for (const int code : {330, 332, 333, 334, 335, 336, 337, 338, 339}) {
    CAPTURE(code);
    REQUIRE(codes->contains(code));
    CHECK(codes->at(code).evidence == Evidence::sibling);
    CHECK_FALSE(codes->at(code).remedy.empty());
    CHECK_FALSE(codes->at(code).source.empty());
  }
  CHECK_FALSE(codes->contains(999));
}

TEST_CASE("simulation: the tools that the contract's examples show") {
  const auto bm = shipped().load_simulation("doga-bm");
  REQUIRE(bm.has_value());
  const Profile bm_profile = load("doga-bm");
  REQUIRE(bm->identity.size() == 17);
  const auto identity = catalogue::decode_identity(
      *bm_profile.identity, ByteView(bm->identity).first(bm->identity_bytes));
  CHECK(identity.tool_model == "3204");
  CHECK(identity.serial == "1021100042");
  CHECK(identity.firmware == 2103U);
  CHECK(generation_of(*bm_profile.identity, identity) == catalogue::Generation::known);

  const auto bmt = shipped().load_simulation("doga-bmt");
  REQUIRE(bmt.has_value());
  const auto long_identity = catalogue::decode_identity(
      *load("doga-bmt").identity, ByteView(bmt->identity).first(bmt->identity_bytes));
  CHECK(bmt->identity_bytes == 13);
  CHECK(long_identity.serial == "0123190742");
  CHECK(long_identity.product_profile == "doga-bmt");
  CHECK(long_identity.tool_model == "3245");
  CHECK(long_identity.notes.empty());
}

TEST_CASE("simulation: every start value of a preset lies within the simulated tool's limits") {
  for (const char* name : {"doga-bm", "doga-bmt"}) {
    const Profile profile = load(name);
    const auto start = shipped().load_simulation(name);
    REQUIRE(start.has_value());
    const auto presets = profile.select({"preset.*"});
    REQUIRE(presets.has_value());
    std::set<std::int64_t> torques;
    for (const Parameter& preset : *presets) {
      CAPTURE(name);
      CAPTURE(preset.name);
      std::int64_t raw = 0;
      std::int64_t minimum = 0;
      std::int64_t maximum = 0;
      for (const auto& value : start->values) {
        if (glob_match(value.pattern, preset.name)) raw = value.raw;
      }
      for (const auto& limit : start->limits) {
        if (!glob_match(limit.pattern, preset.name)) continue;
        minimum = limit.minimum;
        maximum = limit.maximum;
      }
      CHECK(raw >= minimum);
      CHECK(raw <= maximum);
      if (preset.name.view().ends_with("target-torque")) torques.insert(raw);
    }
    CHECK(torques.size() == 15);  // presets can be told apart
  }
}
