#include "spindle/files/dump_file.hpp"

#include <doctest/doctest.h>

#include <numeric>

using namespace spindle;
using namespace spindle::files;
using modbus::RegisterTable;

namespace {

Dump example() {
  Registers many(40);
  std::iota(many.begin(), many.end(), std::uint16_t{100});
  return {.time = "2026-11-22T10:15:30.123Z",
          .version = "1",
          .target = "a \"b\"",
          .profile = "doga-bm",
          .identity = catalogue::SnapshotIdentity{.model = "BM", .serial = "0012", .raw = {1, 2}},
          .runs = {{RegisterTable::holding, 0, {1, 65535}},
                   {RegisterTable::input, 0, many},
                   {RegisterTable::holding, 65535, {7}}}};
}

std::string fault(const std::string& text) {
  const auto dump = read_dump(text, "d.yaml");
  return dump ? "" : dump.error().message;
}

std::string changed(std::string text, std::string_view old, std::string_view by) {
  const auto at = text.find(old);
  REQUIRE(at != std::string::npos);
  return text.replace(at, old.size(), by);
}

}  // namespace

TEST_CASE("a dump reads back as it was written") {
  const Dump dump = example();
  const std::string text = render_dump(dump);
  CHECK(is_dump(text));
  const auto read = read_dump(text, "d.yaml");
  REQUIRE_MESSAGE(read.has_value(), read.error().message);
  CHECK(render_dump(*read) == text);
  CHECK(read->target == dump.target);
  CHECK(read->identity->serial == "0012");
  CHECK(read->runs.at(1).values == dump.runs.at(1).values);
}

TEST_CASE("a dump of a whole table reads back") {
  Dump dump = example();
  dump.identity.reset();
  dump.profile.clear();
  dump.runs = {{RegisterTable::holding, 0, Registers(0x10000, 0xFFFF)}};
  const auto read = read_dump(render_dump(dump), "d.yaml");
  REQUIRE_MESSAGE(read.has_value(), read.error().message);
  CHECK(read->runs.front().values.size() == 0x10000);
}

TEST_CASE("what is no dump, or no whole one") {
  const std::string text = render_dump(example());
  CHECK_FALSE(is_dump("kind: spindle-backup\n"));
  CHECK_FALSE(fault("").empty());
  CHECK_FALSE(fault("kind: spindle-dump\n---\na: 1\n").empty());
  CHECK_FALSE(fault(text.substr(0, text.find("end:"))).empty());
  for (const auto& [old, by] : std::initializer_list<std::pair<const char*, const char*>>{
           {"format: 1", "format: 2"},
           {"spindle-dump", "spindle-backup"},
           {"runs: 3", "runs: 2"},
           {"registers: 43", "registers: 44"},
           {"65535]", "65536]"},
           {"from: 65535", "from: 1"},
           {"[7]", "[7, 8]"},
           {"[7]", "[]"},
           {"[7]", "7"},
           {"input", "inputs"},
           {"target: ", "tarqet: "},
           {"from: 65535", "fron: 65535"},
           {"time: ", "time: []\nother: "}}) {
    CAPTURE(old);
    CHECK(fault(changed(text, old, by)).starts_with("d.yaml:"));
  }
}
