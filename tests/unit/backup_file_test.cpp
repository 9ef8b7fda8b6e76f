#include "spindle/files/backup_file.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "spindle/files/profile_store.hpp"
#include "spindle/posix/disk.hpp"
#include "support/edit_list.hpp"

using namespace spindle;
using catalogue::Missing;
using catalogue::Profile;
using catalogue::Snapshot;
using files::read_backup;
using files::render_backup;
using files::resolve_backup;

namespace {

const Profile& bm() {
  static const Profile profile =
      files::ProfileStore({SPINDLE_SOURCE_DIR "/profiles"}, posix::source_disk())
          .load("doga-bm")
          .value();
  return profile;
}

/// A pair and a signed value beside the numbered ones, and a name that needs quotes in YAML.
Profile odd_profile() {
  Profile profile;
  profile.id = "odd";
  const auto add = [&](std::string name, std::uint16_t address, catalogue::Kind kind) {
    catalogue::Parameter made;
    made.name = std::move(name);
    made.address = {address};
    made.encoding.kind = kind;
    made.access = catalogue::Access::read_write;
    test::append(profile.parameters, made);
  };
  add("speed", 1, catalogue::Kind::u32);
  add("offset", 3, catalogue::Kind::i16);
  add("on", 4, catalogue::Kind::u16);
  return profile;
}

void add(Snapshot& snapshot, const Profile& profile, const std::string& name, Registers raw) {
  const auto parameter = profile.find(name).value();
  auto value = catalogue::decode(parameter, raw).value();
  snapshot.entries.push_back(
      {.parameter = parameter, .raw = std::move(raw), .value = std::move(value)});
}

Snapshot small_snapshot() {
  Snapshot snapshot{.time = "2026-11-22T10:15:30.123Z",
                    .version = "0.1.0",
                    .target = "station 3: \"the\\ third\"\n\x7f",
                    .profile = "doga-bm",
                    .fingerprint = "0123456789abcdef"};
  snapshot.identity = catalogue::SnapshotIdentity{
      .model = "3204", .model_code = 3, .serial = "0021100042", .firmware = 2103, .raw = {0, 0xA5}};
  add(snapshot, bm(), "preset.1.mode", {0});
  add(snapshot, bm(), "preset.1.target-torque", {271});
  snapshot.entries.back().unit = "N.m";
  snapshot.entries.back().minimum = Decimal(0, -2);
  snapshot.entries.back().maximum = Decimal(600, -2);
  add(snapshot, bm(), "p300", {7});
  snapshot.missing = {{bm().find("p564").value(), Missing::absent},
                      {bm().find("p301").value(), Missing::unreadable},
                      {bm().find("p302").value(), Missing::left_out}};
  return snapshot;
}

Result<Snapshot> load(const std::string& text, const Profile& profile = bm()) {
  return read_backup(text, "b.yaml").and_then([&](const files::BackupFile& file) {
    return resolve_backup(file, profile);
  });
}

/// What is wrong with the small backup after one text was replaced.
std::string fault_after(const std::string& old_text, const std::string& new_text) {
  std::string text = render_backup(small_snapshot());
  const std::size_t at = text.find(old_text);
  REQUIRE(at != std::string::npos);
  const auto loaded = load(text.replace(at, old_text.size(), new_text));
  if (loaded) return "nothing";
  CHECK(loaded.error().status() == ExitStatus::bad_file);
  return loaded.error().message;
}

}  // namespace

TEST_CASE("a backup is YAML with one parameter a line") {
  CHECK(render_backup(small_snapshot()) ==
        "# A backup of one tool, one parameter a line. A value may be edited: change 'value' and\n"
        "# leave out 'raw', or change both. 'spindle diff' compares it, 'spindle restore' writes "
        "it.\n"
        "format: 1\n"
        "kind: spindle-backup\n"
        "time: \"2026-11-22T10:15:30.123Z\"\n"
        "spindle: \"0.1.0\"\n"
        "target: \"station 3: \\\"the\\\\ third\\\"\\x0a\\x7f\"\n"
        "profile: {id: doga-bm, fingerprint: \"0123456789abcdef\"}\n"
        "identity: {model: \"3204\", model-code: 3, serial: \"0021100042\", firmware: 2103, raw: "
        "\"00 A5\"}\n"
        "parameters:\n"
        "  - {name: preset.1.mode, register: 1, raw: 0, value: \"TC/AM\"}\n"
        "  - {name: preset.1.target-torque, register: 2, raw: 271, value: 2.71, unit: \"N.m\", "
        "minimum: 0.00, maximum: 6.00}\n"
        "  - {name: p300, register: 300, raw: 7, value: 7}\n"
        "missing:\n"
        "  - {name: p564, register: 564, why: absent}\n"
        "  - {name: p301, register: 301, why: unreadable}\n"
        "  - {name: p302, register: 302, why: left-out}\n"
        "end: {parameters: 3, missing: 3}\n");
}

TEST_CASE("what was written is read again, and written the same") {
  const std::string text = render_backup(small_snapshot());
  const auto loaded = load(text);
  REQUIRE_MESSAGE(loaded.has_value(), describe(loaded.error()));
  CHECK(render_backup(*loaded) == text);
  CHECK(loaded->target == small_snapshot().target);
  CHECK(loaded->identity->serial == "0021100042");
  CHECK(loaded->find_missing("p302")->why == Missing::left_out);
}

TEST_CASE("pairs, signs and names that YAML would take for something else come back") {
  const Profile profile = odd_profile();
  Snapshot snapshot{
      .time = "t", .version = "v", .target = "x", .profile = "odd", .fingerprint = "f"};
  add(snapshot, profile, "speed", {1, 2});
  add(snapshot, profile, "offset", {0xFFFF});
  add(snapshot, profile, "on", {5});
  const std::string text = render_backup(snapshot);
  CHECK(text.find("raw: [1, 2], value: 65538") != std::string::npos);
  CHECK(text.find("value: -1") != std::string::npos);
  CHECK(text.find("name: \"on\"") != std::string::npos);
  const auto loaded = load(text, profile);
  REQUIRE_MESSAGE(loaded.has_value(), describe(loaded.error()));
  CHECK(render_backup(*loaded) == text);
}

namespace {

/// Characters that readers of YAML, terminals and editors treat each in its own way.
const std::vector<std::string>& hostile_characters() {
  static const std::vector<std::string> characters = [] {
    std::vector<std::string> made = {
        "a",      "7",      " ",          "  ",         ": ",     " #",     "#",      "'",
        "\"",     "\\",     "\\N",        "\\x41",      "{",      "}",      "[",      "]",
        ",",      "- ",     "? ",         "&x",         "*x",     "!x",     "|",      ">",
        "%",      "@",      "`",          "~",          "---",    "...",    "null",   "true",
        "0x1F",   "1e3",    "é",          "ト",         "°",      "Ω",      "\u0085", "\u00a0",
        "\u00ad", "\u200b", "\u200e",     "\u2028",     "\u2029", "\u202e", "\u2066", "\ufeff",
        "\ufffd", "\uffff", "\U0001f529", "\U0010ffff", "\u0300", "\u3000", "\ue000", "\ud7ff"};
    for (char c = 0; c < ' '; ++c) made.emplace_back(1, c);
    made.emplace_back(1, '\x7f');
    return made;
  }();
  return characters;
}

std::string hostile_text(std::mt19937& random) {
  const auto& characters = hostile_characters();
  std::string text;
  const auto pieces = std::uniform_int_distribution<int>(0, 12)(random);
  for (int i = 0; i < pieces; ++i) {
    text +=
        characters[std::uniform_int_distribution<std::size_t>(0, characters.size() - 1)(random)];
  }
  return text;
}

}  // namespace

TEST_CASE("whatever is in its texts, a backup is read back equal") {
  std::mt19937 random(20261122);
  for (int round = 0; round < 400; ++round) {
    CAPTURE(round);
    // The first rounds take each character alone, and between two others.
    const auto& characters = hostile_characters();
    const auto at = static_cast<std::size_t>(round) / 2;
    const std::string label = at < characters.size()
                                  ? (round % 2 == 0 ? characters[at] : "x" + characters[at] + "y")
                                  : hostile_text(random) + "z";
    Profile profile = odd_profile();
    test::edit(profile.parameters, 1, [&](catalogue::Parameter& parameter) {
      parameter.labels = {{-2, label}, {-3, "other"}};
    });
    test::edit(profile.parameters, 2,
               [&](catalogue::Parameter& parameter) { parameter.unit = label; });
    profile.id = label;
    Snapshot snapshot{.time = "t" + hostile_text(random),
                      .version = "v" + hostile_text(random),
                      .target = label,
                      .profile = label,
                      .fingerprint = "f" + hostile_text(random)};
    snapshot.identity = catalogue::SnapshotIdentity{.model = label,
                                                    .model_code = 3,
                                                    .serial = hostile_text(random) + "s",
                                                    .firmware = 1,
                                                    .raw = {7}};
    add(snapshot, profile, "offset", {0xFFFE});
    add(snapshot, profile, "on", {4});
    snapshot.entries.back().unit = label;
    snapshot.missing = {{profile.find("speed").value(), Missing::absent}};
    const std::string text = render_backup(snapshot);
    CAPTURE(text);
    const auto loaded = load(text, profile);
    REQUIRE_MESSAGE(loaded.has_value(), describe(loaded.error()));
    CHECK(loaded->time == snapshot.time);
    CHECK(loaded->version == snapshot.version);
    CHECK(loaded->target == snapshot.target);
    CHECK(loaded->profile == snapshot.profile);
    CHECK(loaded->fingerprint == snapshot.fingerprint);
    CHECK(loaded->identity->model == snapshot.identity->model);
    CHECK(loaded->identity->serial == snapshot.identity->serial);
    CHECK(loaded->entries.at(0).value.label == label);
    CHECK(loaded->entries.at(1).unit == label);
    CHECK(render_backup(*loaded) == text);
    // Each line is one of the file: nothing in a text ends it early.
    CHECK(std::count(text.begin(), text.end(), '\n') == 15);
  }
}

TEST_CASE("a text that is none does not keep a backup from being read") {
  Snapshot snapshot{
      .time = "t", .version = "v", .target = "a\xff\x85z", .profile = "odd", .fingerprint = "f"};
  const auto loaded = load(render_backup(snapshot), odd_profile());
  REQUIRE_MESSAGE(loaded.has_value(), describe(loaded.error()));
  CHECK(loaded->target == "a\ufffd\ufffdz");
}

TEST_CASE("an empty backup is one too") {
  const Snapshot empty{
      .time = "t", .version = "v", .target = "x", .profile = "odd", .fingerprint = "f"};
  CHECK(load(render_backup(empty)).has_value());
}

TEST_CASE("every register value of every kind comes back") {
  Profile profile = odd_profile();
  for (std::uint32_t word = 0; word <= 0xFFFF; word += 257) {
    Snapshot snapshot{
        .time = "t", .version = "v", .target = "x", .profile = "odd", .fingerprint = "f"};
    const auto low = static_cast<std::uint16_t>(word);
    add(snapshot, profile, "speed", {low, static_cast<std::uint16_t>(~low)});
    add(snapshot, profile, "offset", {low});
    const auto loaded = load(render_backup(snapshot), profile);
    REQUIRE(loaded.has_value());
    REQUIRE(loaded->entries[0].raw == snapshot.entries[0].raw);
    REQUIRE(loaded->entries[1].raw == snapshot.entries[1].raw);
  }
}

TEST_CASE("a file cut at any byte is refused with its place") {
  const std::string text = render_backup(small_snapshot());
  const std::size_t whole = text.rfind('}') + 1;
  for (std::size_t size = 0; size < whole; ++size) {
    CAPTURE(size);
    const auto loaded = load(text.substr(0, size));
    REQUIRE_FALSE(loaded.has_value());
    CHECK(loaded.error().status() == ExitStatus::bad_file);
    CHECK(loaded.error().message.starts_with("b.yaml:"));
  }
  CHECK(load(text.substr(0, whole)).has_value());
}

TEST_CASE("values may be edited where value and raw agree, or one of them is left out") {
  const std::string old_text = "raw: 271, value: 2.71";
  for (const char* new_text : {"value: 2.71", "raw: 271", "raw: 0x10F", "raw: 271, value: 2.710",
                               "raw: [271], value: 2.71", "raw: 310, value: 3.1"}) {
    CHECK(fault_after(old_text, new_text) == "nothing");
  }
  for (const char* label : {"value: tc/am", "raw: 0, value: 0", "value: AC/TM"}) {
    CHECK(fault_after("raw: 0, value: \"TC/AM\"", label) == "nothing");
  }
}

TEST_CASE("the identity's bytes may stand further apart, or be none") {
  CHECK(fault_after("raw: \"00 A5\"", "raw: \" 00   A5 \"") == "nothing");
  CHECK(fault_after("raw: \"00 A5\"", "raw: \"\"") == "nothing");
}

TEST_CASE("a value outside the profile's labels is what the tool held, not a fault") {
  CHECK(fault_after("raw: 0, value: \"TC/AM\"", "raw: 9, value: 9") == "nothing");
}

TEST_CASE("every fault has its place and its words") {
  struct Row {
    std::string old_text;
    std::string new_text;
    std::string message;
  };
  const std::string value = "raw: 271, value: 2.71";
  const Row rows[] = {
      {"format: 1", "format: 2", "b.yaml:3:9: this version reads backups of format 1"},
      {"kind: spindle-backup", "kind: other",
       "b.yaml:4:7: this is no backup: it does not say 'kind: spindle-backup'"},
      {"time: ", "tmie: ", "b.yaml:3:1: key 'time' is missing (and 1 more fault)"},
      {value, "raw: 271, value: 2.72",
       "b.yaml:12:66: preset.1.target-torque: value '2.72' and raw 271 (2.71) say different "
       "things; leave out the one that is wrong"},
      {value, "value: 2.715",
       "b.yaml:12:56: preset.1.target-torque: 2.715 is between two steps of "
       "0.01"},
      {value, "value: .nan", "b.yaml:12:56: preset.1.target-torque: '.nan' is not a number"},
      {value, "value: 1e3", "b.yaml:12:56: preset.1.target-torque: '1e3' is not a number"},
      {value, "value: 999999",
       "b.yaml:12:56: preset.1.target-torque: 999999 is above 655.35, the "
       "most that u16 can hold"},
      {value, "raw: 65536", "b.yaml:12:54: '65536' is not a whole number from 0 to 65535"},
      {value, "raw: []", "b.yaml:12:54: a value has 1 to 125 registers"},
      {value, "raw: [1, 2]", "b.yaml:12:54: preset.1.target-torque: 2 registers, but u16 has 1"},
      {"raw: 7, value: 7", "unit: rpm", "b.yaml:13:5: neither 'value' nor 'raw' is given"},
      {"name: p300", "name: p999",
       "b.yaml:13:5: 'p999' is no stored parameter of profile doga-bm; "
       "numbers go from p1 to p725"},
      {"name: p300", "name: '@holding:300'",
       "b.yaml:13:5: '@holding:300' is no stored parameter of profile doga-bm"},
      {"name: p300", "name: status.ready",
       "b.yaml:13:5: 'status.ready' is register 3306 (input) in profile doga-bm, not 300 "
       "(holding)"},
      {"name: p300, register: 300", "name: p2, register: 2",
       "b.yaml:13:5: register 2 is here twice"},
      {"name: p564, register: 564", "name: p300, register: 300",
       "b.yaml:15:5: register 300 is here twice"},
      {"why: absent", "why: gone",
       "b.yaml:15:38: unknown reason 'gone'; known: absent, unreadable, "
       "left-out"},
      {"end: {parameters: 3", "end: {parameters: 4",
       "b.yaml:18:19: 4 lines of 'parameters' were written, but 3 are there"},
      {"end: {parameters: 3, missing: 3}\n", "",
       "b.yaml:18:1: the end marker is missing: the file is cut off"},
      {"raw: \"00 A5\"", "raw: \"00 G5\"",
       "b.yaml:9:85: 'G5' is not a byte of two hexadecimal digits"},
  };
  for (const Row& row : rows) {
    CAPTURE(row.new_text);
    const std::string fault = fault_after(row.old_text, row.new_text);
    CHECK(fault.substr(0, row.message.size()) == row.message);
  }
}

TEST_CASE("a name of another version of the profile is found by its register") {
  Profile named = bm();
  catalogue::Parameter screws = named.find("p300").value();
  screws.name = "count.screws";
  screws.encoding.scale = Decimal(1, -1);
  test::append(named.parameters, screws);
  const auto loaded = load(render_backup(small_snapshot()), named);
  REQUIRE_MESSAGE(loaded.has_value(), describe(loaded.error()));
  const auto* entry = loaded->find("count.screws");
  REQUIRE(entry != nullptr);
  CHECK(entry->raw == Registers{7});
  CHECK(entry->value.to_string() == "0.7");

  screws.name = "pair";
  screws.encoding.kind = catalogue::Kind::u32;
  test::edit(named.parameters, named.parameters.size() - 1,
             [&](catalogue::Parameter& last) { last = screws; });
  const auto part = load(render_backup(small_snapshot()), named);
  REQUIRE_FALSE(part.has_value());
  CHECK(part.error().message.starts_with("b.yaml:13:5: 'p300' is part of another parameter"));
}

namespace {

/// A clock, a name, digits, and a power whose steps another parameter says the worth of.
Profile hard_profile() {
  Profile profile;
  profile.id = "hard";
  const auto add = [&](std::string name, std::uint16_t address, catalogue::Encoding encoding) {
    catalogue::Parameter made;
    made.name = std::move(name);
    made.address = {address};
    made.encoding = encoding;
    made.access = catalogue::Access::read_write;
    if (made.name == "power") made.scale_by = "exponent";
    test::append(profile.parameters, made);
  };
  using catalogue::Kind;
  add("clock", 0, {.kind = Kind::date, .date = catalogue::DateLayout::bytes});
  add("line", 3, {.kind = Kind::text, .length = 4});
  add("digits", 5, {.kind = Kind::bcd, .length = 2});
  add("power", 6, {});
  add("exponent", 7, {.kind = Kind::i16});
  return profile;
}

std::string with_lines(const std::string& lines, std::size_t count) {
  Snapshot empty{.time = "t", .version = "v", .target = "x", .profile = "hard", .fingerprint = "f"};
  std::string text = render_backup(empty);
  text.replace(text.find("parameters: []"), 14, "parameters:\n" + lines);
  text.replace(text.find("{parameters: 0"), 14, "{parameters: " + std::to_string(count));
  return text;
}

}  // namespace

TEST_CASE("what is no value of its encoding is kept as registers, and comes back") {
  const Profile profile = hard_profile();
  Snapshot snapshot{
      .time = "t", .version = "v", .target = "x", .profile = "hard", .fingerprint = "f"};
  const auto add_raw = [&](const std::string& name, const Registers& raw) {
    const auto parameter = profile.find(name).value();
    snapshot.entries.push_back({.parameter = parameter,
                                .raw = raw,
                                .value = catalogue::decode_or_raw(parameter, raw).value()});
  };
  add_raw("clock", {0xFFFF, 0xFFFF, 0});
  add_raw("line", {0x41FF, 0});
  add_raw("digits", {0x12A4});
  const std::string text = render_backup(snapshot);
  CHECK(text.find(", value: ") == std::string::npos);
  const auto loaded = load(text, profile);
  REQUIRE_MESSAGE(loaded.has_value(), describe(loaded.error()));
  REQUIRE(loaded->entries.size() == 3);
  for (std::size_t i = 0; i < 3; ++i) {
    CHECK(loaded->entries[i].raw == snapshot.entries[i].raw);
    CHECK(loaded->entries[i].value == snapshot.entries[i].value);
  }
  CHECK(render_backup(*loaded) == text);
}

TEST_CASE("a value whose steps another parameter says the worth of has that worth beside it") {
  const Profile profile = hard_profile();
  const auto loaded = load(
      with_lines("  - {name: power, register: 6, raw: 50, value: 5000, step: 100, unit: W}\n", 1),
      profile);
  REQUIRE_MESSAGE(loaded.has_value(), describe(loaded.error()));
  CHECK(loaded->entries[0].step == Decimal(100));
  CHECK(loaded->entries[0].value.number == Decimal(5000));
  const std::string again = render_backup(*loaded);
  CAPTURE(again);
  CHECK(again.find("{name: power, register: 6, raw: 50, value: 5000, step: 100, unit: \"W\"}") !=
        std::string::npos);
  const auto edited =
      load(with_lines("  - {name: power, register: 6, value: 5100, step: 100}\n", 1), profile);
  REQUIRE(edited.has_value());
  CHECK(edited->entries[0].raw == Registers{51});

  const auto fault = [&](const std::string& line) {
    const auto refused = load(with_lines("  - " + line + "\n", 1), profile);
    return refused ? std::string("none") : describe(refused.error());
  };
  CHECK(fault("{name: power, register: 6, value: 5100}").find("key 'step' is missing") !=
        std::string::npos);
  CHECK(fault("{name: power, register: 6, value: 5150, step: 100}").find("between two steps") !=
        std::string::npos);
  CHECK(fault("{name: digits, register: 5, raw: 1, step: 100}").find("are not worth 100") !=
        std::string::npos);
  CHECK(fault("{name: power, register: 6, raw: 1, step: 0}").find("are not worth 0") !=
        std::string::npos);
}

TEST_CASE("names of bits are those that counted when the backup was made") {
  Profile profile;
  profile.id = "hard";
  catalogue::Parameter word;
  word.name = "word";
  word.access = catalogue::Access::read_write;
  word.bits = {{15, "always"}, {0, "start", 0}, {1, "stop", 0}, {0, "ready", 1}, {1, "start", 1}};
  word.bits_by = "mode";
  test::append(profile.parameters, word);
  const auto raw_of = [&](const std::string& line) {
    const auto loaded =
        load(with_lines("  - {name: word, register: 0, " + line + "}\n", 1), profile);
    return loaded ? loaded->entries[0].raw : Registers();
  };
  CHECK(raw_of("raw: 32769, value: start always") == Registers{32769});
  CHECK(raw_of("raw: 32769, value: ready always") == Registers{32769});
  CHECK(raw_of("raw: 32769, value: stop always").empty());
  CHECK(raw_of("value: always") == Registers{32768});
  CHECK(raw_of("value: start").empty());  // bit 0, or bit 1
}
