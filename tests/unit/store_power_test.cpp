// What a store promises when the power goes, the disk is full or fails: SQLite runs on files in
// memory that forget what was not synced.
#include <doctest/doctest.h>

#include <algorithm>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "support/power_disk.hpp"
#include "support/store_entries.hpp"
#include "support/temporary_folder.hpp"

using namespace spindle;
using namespace spindle::store;
using spindle::test::new_event;
using spindle::test::PowerDisk;
using spindle::test::second;
using spindle::test::stored_events;
using spindle::test::StoredEvent;
using spindle::test::TemporaryFolder;

namespace {

constexpr std::uint16_t group = 3;
constexpr std::uint16_t last_number = 18;

/// What a group of events brings with it: a gap in front of its first, an event that conflicts
/// with the one before, settings, a happening, and the time.
std::vector<Entry> entries_of(RowId tool, RowId place, std::uint16_t first) {
  std::vector<Entry> entries;
  for (std::uint16_t number = first; number < first + group; ++number) {
    NewEvent event = new_event(tool, place, static_cast<std::uint16_t>(2 * number));
    if (number == first) {
      event.gap = Gap{.after = static_cast<std::uint16_t>(2 * number - 2),
                      .before = static_cast<std::uint16_t>(2 * number),
                      .missed = 1,
                      .began = second(number),
                      .ended = second(number),
                      .reason = "lost"};
    }
    entries.emplace_back(std::move(event));
  }
  entries.emplace_back(PresetSettings{.tool = tool, .preset = 1, .since = second(first)});
  entries.emplace_back(Happening{.tool = tool, .at = second(first), .type = "link", .json = "{}"});
  entries.emplace_back(Seen{.tool = tool, .at = second(first + group)});
  return entries;
}

/// Everything that was told to be stored, and what went wrong first.
struct Told {
  std::vector<RowId> events = {};
  std::vector<RowId> gaps = {};
  bool is_whole = false;
};

bool write_groups(Writer& writer, std::uint16_t from, std::uint16_t to, Told& told) {
  const auto tool = writer.tool({.maker = "DOGA", .serial = "1"}, "BM");
  if (!tool) return false;
  const auto place = writer.place({.tool = *tool, .name = "a", .url = "tcp://a", .profile = "bm"});
  if (!place) return false;
  for (std::uint16_t first = from; first < to; first = static_cast<std::uint16_t>(first + group)) {
    const auto stored = writer.commit(entries_of(*tool, *place, first));
    if (!stored) return false;
    for (const Stored& one : *stored) {
      if (one.as == Stored::As::row && one.gap != 0) told.gaps.push_back(one.gap);
    }
    for (std::size_t i = 0; i < group; ++i) told.events.push_back((*stored)[i].id);
  }
  return true;
}

/// Makes a store, closes it, opens it again and goes on.
Told write_all(const std::string& path) {
  Told told;
  for (const auto& [from, to] : {std::pair{1, 10}, std::pair{10, 19}}) {
    auto writer = Writer::open(path);
    if (!writer) return told;
    if (!write_groups(**writer, static_cast<std::uint16_t>(from), static_cast<std::uint16_t>(to),
                      told)) {
      return told;
    }
  }
  told.is_whole = true;
  return told;
}

/// The same, but tries again what failed, a store that cannot be opened included.
Told write_patiently(const std::string& path, std::size_t& failures) {
  constexpr std::size_t most_failures = 20;
  Told told;
  std::unique_ptr<Writer> writer;
  std::uint16_t first = 1;
  while (first <= last_number && failures <= most_failures) {
    if (!writer) {
      auto opened = Writer::open(path);
      if (opened) writer = std::move(*opened);
    }
    const auto next = static_cast<std::uint16_t>(first + group);
    if (writer && write_groups(*writer, first, next, told)) {
      first = next;
    } else {
      ++failures;
    }
  }
  told.is_whole = first > last_number;
  return told;
}

template <typename Row>
std::set<RowId> ids_of(const std::vector<Row>& rows) {
  std::set<RowId> ids;
  for (const Row& row : rows) ids.insert(row.id);
  return ids;
}

/// All that was told is there, nothing is twice or half stored, and what comes next is stored.
void check_after(const std::string& path, const Told& told) {
  std::size_t rows = 0;
  {
    auto writer = Writer::open(path);
    REQUIRE_MESSAGE(writer, describe(writer.error()));
  }
  {
    auto reader = Reader::open(path);
    REQUIRE_MESSAGE(reader, describe(reader.error()));
    const auto findings = (*reader)->integrity();
    REQUIRE(findings);
    CHECK(*findings == std::vector<std::string>{});
    const std::vector<StoredEvent> events = stored_events(**reader);
    const auto gaps = (*reader)->gaps({});
    REQUIRE(gaps);
    rows = events.size();
    CHECK(events.size() % group == 0);
    CHECK(gaps->size() * group == events.size());
    const std::set<RowId> found = ids_of(events);
    CHECK(std::ranges::includes(found, told.events));
    CHECK(std::ranges::includes(ids_of(*gaps), told.gaps));
    std::vector<std::size_t> numbers;
    std::vector<std::size_t> expected;
    for (const StoredEvent& event : events) {
      numbers.push_back(event.number);
      expected.push_back(2 * numbers.size());
    }
    CHECK(numbers == expected);
  }
  auto writer = Writer::open(path);
  REQUIRE(writer);
  Told later;
  const auto next = static_cast<std::uint16_t>(rows + 1);
  CHECK(write_groups(**writer, next, static_cast<std::uint16_t>(next + group), later));
  CHECK(later.events.size() == group);
}

}  // namespace

TEST_CASE("a power cut at any moment loses nothing that was told") {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/events.db";
  std::size_t cuts = 0;
  for (const auto keeps :
       {PowerDisk::Keeps::nothing, PowerDisk::Keeps::some, PowerDisk::Keeps::all}) {
    for (std::size_t change = 1;; ++change) {
      CAPTURE(change);
      CAPTURE(static_cast<int>(keeps));
      PowerDisk disk;
      disk.dies_behind = change;
      const Told told = write_all(path);
      if (told.is_whole && disk.changes < change) break;
      disk.cut(keeps, static_cast<std::uint32_t>(change));
      check_after(path, told);
      ++cuts;
    }
  }
  // At least one write and one sync a commit.
  CHECK(cuts > std::size_t{3} * 2 * last_number / group);
}

TEST_CASE("a full or failing disk loses nothing and stops nothing") {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/events.db";
  for (const int answer : {SQLITE_FULL, SQLITE_IOERR}) {
    for (std::size_t change = 1;; ++change) {
      CAPTURE(change);
      CAPTURE(answer);
      PowerDisk disk;
      disk.trouble = {.first = change, .last = change + 4, .answer = answer};
      std::size_t failures = 0;
      const Told told = write_patiently(path, failures);
      if (disk.changes < change) break;
      // Only a checkpoint may fail unnoticed.
      CHECK(told.is_whole);
      CHECK(told.events.size() == last_number);
      disk.trouble.reset();
      check_after(path, told);
    }
  }
}

TEST_CASE("an error says what happened to which file") {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/events.db";
  const auto fails_with = [&](int answer) {
    PowerDisk disk;
    auto writer = Writer::open(path);
    REQUIRE(writer);
    disk.trouble = {.first = disk.changes + 1, .last = disk.changes + 1, .answer = answer};
    const auto tool = (*writer)->tool({.maker = "DOGA", .serial = "1"}, "");
    REQUIRE_FALSE(tool);
    CHECK(tool.error().code == Errc::storage);
    CHECK(tool.error().name == path);
    CHECK_FALSE(*(*writer)->has_tool({.maker = "DOGA", .serial = "1"}));
    CHECK(*(*writer)->tool({.maker = "DOGA", .serial = "1"}, "") == 1);
    return message_of(tool.error());
  };
  CHECK(fails_with(SQLITE_FULL) == "the disk is full (database or disk is full)");
  CHECK(fails_with(SQLITE_IOERR_WRITE) == "the disk failed (disk I/O error)");
}

TEST_CASE("a hundred thousand events in groups take few syncs") {
  constexpr std::size_t groups = 200;
  constexpr std::uint16_t events = 500;
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/events.db";
  PowerDisk disk;
  {
    auto writer = Writer::open(path);
    REQUIRE(writer);
    const RowId tool = *(*writer)->tool({.maker = "DOGA", .serial = "1"}, "BM");
    const RowId place = *(*writer)->place({.tool = tool, .name = "a", .url = "u", .profile = "p"});
    const std::size_t before = disk.syncs;
    std::uint16_t number = 0;
    for (std::size_t i = 0; i < groups; ++i) {
      std::vector<Entry> entries;
      for (std::uint16_t event = 0; event < events; ++event) {
        NewEvent entry = new_event(tool, place, number);
        entry.event.at = second(static_cast<std::int64_t>(i * events + event));
        if (number == 0 && i != 0) entry.begins = EpochReason::wrap;
        entries.emplace_back(std::move(entry));
        ++number;
      }
      REQUIRE((*writer)->commit(entries));
    }
    CHECK(disk.syncs - before >= groups);
    CHECK(disk.syncs - before <= 2 * groups);
    // The write-ahead log is copied while it grows.
    constexpr std::size_t largest_log = 10U << 20U;
    REQUIRE(disk.content(path + "-wal") != nullptr);
    CHECK(disk.content(path + "-wal")->size() < largest_log);
  }
  auto reader = Reader::open(path);
  REQUIRE(reader);
  const auto coverage = (*reader)->coverage();
  REQUIRE(coverage);
  REQUIRE(coverage->size() == 2);
  CHECK(coverage->at(0).rows + coverage->at(1).rows == groups * events);
  CHECK(coverage->at(0).holes + coverage->at(1).holes == 0);
}

TEST_CASE("a store in a folder that is not writable is read where it is complete") {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/events.db";
  PowerDisk disk;
  write_all(path);
  disk.refuses_new_files = true;
  {
    auto reader = Reader::open(path);
    REQUIRE_MESSAGE(reader, describe(reader.error()));
    CHECK(stored_events(**reader).size() == last_number);
  }

  // What is in a log that was left behind must not be left out in silence: the power goes before
  // the end of the program copies it.
  disk.refuses_new_files = false;
  {
    auto writer = Writer::open(path);
    REQUIRE(writer);
    Told told;
    REQUIRE(write_groups(**writer, last_number + 1, last_number + 1 + group, told));
    disk.dies_behind = disk.changes;
  }
  disk.cut(PowerDisk::Keeps::all, 0);
  CHECK(disk.content(path + "-wal") != nullptr);
  disk.refuses_new_files = true;
  const auto incomplete = Reader::open(path);
  REQUIRE_FALSE(incomplete);
  CHECK(incomplete.error().code == Errc::storage);
  CHECK(incomplete.error().hint ==
        "what was stored last has to be read by a user who may write in its folder");
  disk.refuses_new_files = false;
  auto reader = Reader::open(path);
  REQUIRE(reader);
  CHECK(stored_events(**reader).size() == last_number + group);
}
