#include <doctest/doctest.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <sqlite3.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "spindle/store/reader.hpp"
#include "spindle/store/writer.hpp"
#include "store/folder.hpp"
#include "support/store_entries.hpp"
#include "support/temporary_folder.hpp"

using namespace spindle;
using namespace spindle::store;
using spindle::test::new_event;
using spindle::test::second;
using spindle::test::stored_events;
using spindle::test::StoredEvent;
using spindle::test::TemporaryFolder;

namespace {

/// A statement by another program.
void run_sql(const std::string& path, const std::string& sql) {
  sqlite3* database = nullptr;
  REQUIRE(sqlite3_open(path.c_str(), &database) == SQLITE_OK);
  const int answer = sqlite3_exec(database, sql.c_str(), nullptr, nullptr, nullptr);
  CHECK_MESSAGE(answer == SQLITE_OK, sqlite3_errmsg(database));
  sqlite3_close(database);
}

std::string content_of(const std::string& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// A store with one tool at one place.
struct Shop {
  TemporaryFolder folder = {};
  std::string path = folder.path() + "/events.db";
  std::unique_ptr<Writer> writer = opened();
  RowId tool = *writer->tool({.maker = "DOGA", .serial = "1021100042"}, "BM");
  RowId place = *writer->place({.tool = tool,
                                .name = "station3",
                                .url = "tcp://a",
                                .profile = "doga-bm",
                                .since = second(0)});

  std::unique_ptr<Writer> opened() const {
    auto made = Writer::open(path);
    REQUIRE_MESSAGE(made, describe(made.error()));
    return std::move(*made);
  }
  std::unique_ptr<Reader> reader() const {
    auto made = Reader::open(path);
    REQUIRE_MESSAGE(made, describe(made.error()));
    return std::move(*made);
  }
  void reopen() {
    writer.reset();
    writer = opened();
  }

  NewEvent event(std::uint16_t number, std::uint16_t variant = 0) const {
    return new_event(tool, place, number, variant);
  }
  NewEvent beginning(EpochReason reason, std::uint16_t number, std::uint16_t variant = 0) const {
    NewEvent entry = event(number, variant);
    entry.begins = reason;
    return entry;
  }
  Stored store(const Entry& entry) const {
    const auto stored = writer->commit(std::array{entry});
    REQUIRE_MESSAGE(stored, describe(stored.error()));
    REQUIRE(stored->size() == 1);
    return stored->front();
  }
  void store_numbers(std::uint16_t first, std::uint16_t last) const {
    std::vector<Entry> entries;
    for (int number = first; number <= last; ++number) {
      entries.emplace_back(event(static_cast<std::uint16_t>(number)));
    }
    REQUIRE(writer->commit(entries));
  }
  Last last() const {
    const auto last = writer->last(tool);
    REQUIRE(last);
    REQUIRE(*last);
    return **last;
  }
  std::vector<Gap> gaps(const Filter& filter = {}) const {
    auto gaps = reader()->gaps(filter);
    REQUIRE(gaps);
    return *gaps;
  }
  std::vector<Coverage> coverage() const {
    auto coverage = reader()->coverage();
    REQUIRE(coverage);
    return *coverage;
  }
  void check_integrity() const {
    const auto findings = reader()->integrity();
    REQUIRE(findings);
    CHECK(*findings == std::vector<std::string>{});
  }
};

Gap gap_between(std::optional<std::uint16_t> after, std::optional<std::uint16_t> before,
                std::optional<std::uint32_t> missed) {
  return {.after = after,
          .before = before,
          .missed = missed,
          .began = second(1),
          .ended = second(2),
          .reason = "link lost"};
}

std::vector<std::uint16_t> numbers_of(const std::vector<StoredEvent>& events) {
  std::vector<std::uint16_t> numbers;
  for (const StoredEvent& event : events) numbers.push_back(event.number);
  return numbers;
}

using Numbers = std::vector<std::uint16_t>;

}  // namespace

// ---- what is stored ----

TEST_CASE("an event is read as it was stored") {
  const Shop shop;
  NewEvent entry = shop.event(7);
  entry.event.tool_time = second(-5);
  entry.event.remembered = true;
  entry.event.barcode = "A-17";
  for (const auto& [word, column] : column_words) {
    entry.event.columns[column] = 1'000 + static_cast<std::int64_t>(column);
  }
  entry.event.columns[Column::torque] = std::nullopt;
  entry.event.raw = {0x0102, 0xFFFE};
  const Stored stored = shop.store(entry);
  CHECK(stored.as == Stored::As::row);
  CHECK(stored.epoch == 0);
  std::size_t events = 0;
  const auto read = shop.reader()->events({}, [&](const EventView& event) {
    ++events;
    CHECK(event.id == stored.id);
    CHECK(event.tool == shop.tool);
    CHECK(event.place == shop.place);
    CHECK(event.epoch == 0);
    CHECK(event.number == 7);
    CHECK(event.at == second(7));
    CHECK(event.tool_time == second(-5));
    CHECK(event.source == "push");
    CHECK(event.kind == "fastening-ok");
    CHECK(event.remembered);
    CHECK(event.barcode == "A-17");
    CHECK(Bytes(event.raw.begin(), event.raw.end()) == Bytes{0x01, 0x02, 0xFF, 0xFE});
    for (const auto& [word, column] : column_words) {
      CAPTURE(word);
      CHECK(event.columns[column] == entry.event.columns[column]);
    }
    return true;
  });
  CHECK(read);
  CHECK(events == 1);
}

TEST_CASE("tools and places have one row for what is the same") {
  const Shop shop;
  CHECK(*shop.writer->tool({.maker = "DOGA", .serial = "1021100042"}, "other") == shop.tool);
  CHECK(*shop.writer->tool({.maker = "HANTAS", .serial = "1021100042"}, "") != shop.tool);
  CHECK(*shop.writer->has_tool({.maker = "DOGA", .serial = "1021100042"}));
  CHECK_FALSE(*shop.writer->has_tool({.maker = "DOGA", .serial = "2"}));

  Place place = {.tool = shop.tool, .name = "station3", .url = "tcp://a", .profile = "doga-bm"};
  CHECK(*shop.writer->place(place) == shop.place);
  place.firmware = 2103;
  const RowId newer = *shop.writer->place(place);
  CHECK(newer != shop.place);
  CHECK(*shop.writer->place(place) == newer);
  place.firmware.reset();
  CHECK(*shop.writer->place(place) > newer);

  const auto reader = shop.reader();
  const auto tools = reader->tools();
  REQUIRE(tools);
  REQUIRE(tools->size() == 2);
  CHECK(tools->at(0).name == ToolName{.maker = "DOGA", .serial = "1021100042"});
  CHECK(tools->at(0).model == "BM");
  CHECK(tools->at(1).model.empty());
  const auto places = reader->places();
  REQUIRE(places);
  REQUIRE(places->size() == 3);
  CHECK(places->at(0).since == second(0));
  CHECK(places->at(1).firmware == 2103);
}

TEST_CASE("settings that did not change are no row") {
  const Shop shop;
  PresetSettings settings = {.tool = shop.tool, .preset = 2, .since = second(5)};
  settings[Setting::target_torque] = 27'100;
  settings[Setting::max_angle] = 90;
  CHECK(shop.store(settings).as == Stored::As::row);
  settings.since = second(9);
  CHECK(shop.store(settings).as == Stored::As::merged);
  settings[Setting::max_angle] = std::nullopt;
  // The clock was set back: what was read later stays the newer one.
  settings.since = second(1);
  CHECK(shop.store(settings).as == Stored::As::row);
  CHECK(shop.store(settings).as == Stored::As::merged);
  const auto read = shop.reader()->settings();
  REQUIRE(read);
  REQUIRE(read->size() == 2);
  CHECK(read->at(0)[Setting::max_angle] == 90);
  CHECK(read->at(0).since == second(5));
  CHECK(read->at(1).since == second(5) + std::chrono::milliseconds(1));
  CHECK(read->at(1)[Setting::target_torque] == 27'100);
  CHECK(read->at(1)[Setting::max_angle] == std::nullopt);
}

TEST_CASE("a happening is stored once") {
  const Shop shop;
  const Happening happening = {
      .tool = shop.tool, .at = second(1), .type = "link", .json = R"({"state":"lost"})"};
  CHECK(shop.store(happening).as == Stored::As::row);
  CHECK(shop.store(happening).as == Stored::As::known);
  CHECK(shop.store(Happening{.at = second(1), .type = "start", .json = "{}"}).as ==
        Stored::As::row);
  std::vector<std::string> types;
  CHECK(shop.reader()->happenings({.kinds = {"link"}}, [&](const Happening& read) {
    CHECK(read.tool == shop.tool);
    CHECK(read.json == happening.json);
    types.push_back(read.type);
    return true;
  }));
  CHECK(types == std::vector<std::string>{"link"});
}

TEST_CASE("until when a tool was listened to") {
  const Shop shop;
  shop.store(shop.event(5));
  CHECK(shop.last().seen == second(5));
  CHECK(shop.store(Seen{.tool = shop.tool, .at = second(60)}).as == Stored::As::merged);
  CHECK(shop.last().seen == second(60));
  CHECK(shop.reader()->places()->front().seen == second(60));
}

// ---- epochs, conflicts, gaps ----

TEST_CASE("the first event of a tool makes its first epoch") {
  const Shop shop;
  CHECK_FALSE(*shop.writer->last(shop.tool));
  CHECK(shop.store(shop.beginning(EpochReason::restart, 1962)).epoch == 0);
  const auto epochs = shop.reader()->epochs();
  REQUIRE(epochs);
  REQUIRE(epochs->size() == 1);
  CHECK(epochs->front().reason == EpochReason::first);
  CHECK(epochs->front().began == second(1962));
  CHECK(shop.last().number == 1962);
  CHECK(shop.last().block == Registers(20, 1962));
}

TEST_CASE("an epoch begins where the counter begins anew") {
  const Shop shop;
  shop.store(shop.event(65'535));
  CHECK(shop.store(shop.beginning(EpochReason::wrap, 0)).epoch == 1);
  CHECK(shop.store(shop.event(1)).epoch == 1);
  CHECK(shop.store(shop.beginning(EpochReason::restart, 1, 1)).epoch == 2);
  CHECK(shop.last().epoch == 2);
  CHECK(shop.last().number == 1);
  const auto epochs = shop.reader()->epochs();
  REQUIRE(epochs);
  REQUIRE(epochs->size() == 3);
  CHECK(epochs->at(1).reason == EpochReason::wrap);
  CHECK(epochs->at(2).reason == EpochReason::restart);
  shop.check_integrity();
}

TEST_CASE("what is handed over again is known, also where it began an epoch or made a gap known") {
  Shop shop;
  NewEvent with_gap = shop.event(9);
  with_gap.gap = gap_between(5, 9, 3);
  const std::vector<Entry> entries = {shop.event(5), with_gap,
                                      shop.beginning(EpochReason::restart, 2)};
  const auto first = shop.writer->commit(entries);
  REQUIRE(first);
  CHECK(first->at(1).gap != 0);
  const auto begun_again = shop.store(entries.back());
  CHECK(begun_again.as == Stored::As::known);
  CHECK(begun_again.id == first->at(2).id);
  CHECK(begun_again.epoch == 1);
  shop.reopen();
  CHECK(shop.store(shop.event(2)).as == Stored::As::known);
  CHECK(stored_events(*shop.reader()).size() == 3);
  CHECK(shop.gaps().size() == 1);

  // Another restart that leads to the same block is another event.
  NewEvent other = shop.beginning(EpochReason::restart, 2);
  other.event.at = second(100);
  CHECK(shop.store(other).epoch == 2);
}

TEST_CASE("an event whose number is taken by another one is never dropped") {
  const Shop shop;
  shop.store_numbers(4, 6);
  CHECK(shop.store(shop.event(6)).as == Stored::As::known);
  const Stored stored = shop.store(shop.event(6, 1));
  CHECK(stored.as == Stored::As::conflict);
  CHECK(stored.epoch == 1);
  CHECK(shop.reader()->epochs()->back().reason == EpochReason::unsure);
  const auto gaps = shop.gaps();
  REQUIRE(gaps.size() == 1);
  CHECK(gaps[0].id == stored.gap);
  CHECK(gaps[0].epoch == 1);
  CHECK(gaps[0].before == 6);
  CHECK(gaps[0].after == std::nullopt);
  CHECK(gaps[0].missed == std::nullopt);
  CHECK(gaps[0].reason ==
        "another event with number 6 was stored before: the tool may have begun to count anew, or "
        "another tool has its serial number");
  CHECK(shop.store(shop.event(6, 1)).as == Stored::As::known);
  CHECK(shop.store(shop.event(7, 1)).epoch == 1);
  CHECK(stored_events(*shop.reader()).size() == 5);
  shop.check_integrity();
}

TEST_CASE("tools have epochs and numbers of their own") {
  const Shop shop;
  const RowId other = *shop.writer->tool({.maker = "DOGA", .serial = "@station4"}, "BM");
  const RowId place = *shop.writer->place({.tool = other, .name = "station4", .url = "tcp://b"});
  shop.store(shop.event(6));
  CHECK(shop.store(new_event(other, place, 6, 1)).as == Stored::As::row);
  CHECK(shop.writer->last(other)->value().epoch == 0);
}

TEST_CASE("a gap is stored once, and moves the last number where it is behind it") {
  const Shop shop;
  shop.store_numbers(1, 5);
  Gap gap = gap_between(5, 9, 3);
  gap.tool = shop.tool;
  gap.at_least = true;
  const Stored stored = shop.store(NewGap{gap});
  CHECK(stored.as == Stored::As::row);
  CHECK(shop.store(NewGap{gap}).as == Stored::As::known);
  CHECK(shop.last().number == 8);
  CHECK(shop.last().block == std::nullopt);
  // The event that ends it brings the same gap.
  NewEvent event = shop.event(9);
  event.gap = gap;
  CHECK(shop.store(event).gap == stored.id);
  CHECK(shop.last().number == 9);
  CHECK(shop.last().block == Registers(20, 9));
  const auto gaps = shop.gaps();
  REQUIRE(gaps.size() == 1);
  CHECK(gaps[0].missed == 3);
  CHECK(gaps[0].at_least);
  CHECK(gaps[0].began == second(1));
  CHECK(gaps[0].ended == second(2));
  CHECK(gaps[0].reason == "link lost");
  shop.check_integrity();

  SUBCASE("one that is nowhere is another one at another time") {
    Gap nowhere = gap_between(std::nullopt, std::nullopt, std::nullopt);
    nowhere.tool = shop.tool;
    shop.store(NewGap{nowhere});
    CHECK(shop.store(NewGap{nowhere}).as == Stored::As::known);
    nowhere.began = second(3);
    CHECK(shop.store(NewGap{nowhere}).as == Stored::As::row);
    CHECK(shop.last().number == 9);
  }
}

TEST_CASE("all entries are stored or none") {
  const Shop shop;
  shop.store_numbers(1, 2);
  NewEvent nowhere = shop.event(4);
  nowhere.event.place = 99;
  const std::vector<Entry> entries = {shop.event(3), shop.beginning(EpochReason::restart, 1, 1),
                                      Happening{.type = "link", .json = "{}"}, nowhere};
  const auto stored = shop.writer->commit(entries);
  REQUIRE_FALSE(stored);
  CHECK(stored.error().code == Errc::internal);
  CHECK(shop.last().epoch == 0);
  CHECK(shop.last().number == 2);
  CHECK(shop.store(shop.event(3)).epoch == 0);
  CHECK(numbers_of(stored_events(*shop.reader())) == Numbers{1, 2, 3});
  CHECK(shop.writer->commit({})->empty());
}

// ---- coverage ----

TEST_CASE("every number is a row, in a gap or a hole") {
  const Shop shop;
  shop.store_numbers(10, 12);
  NewEvent event = shop.event(15);
  event.gap = gap_between(12, 15, 2);
  shop.store(event);
  shop.store(shop.event(18));
  auto coverage = shop.coverage();
  REQUIRE(coverage.size() == 1);
  CHECK(coverage[0].tool == shop.tool);
  CHECK(coverage[0].first == 10);
  CHECK(coverage[0].last == 18);
  CHECK(coverage[0].rows == 5);
  CHECK(coverage[0].in_gaps == 2);
  CHECK(coverage[0].holes == 2);
  CHECK(coverage[0].unknown_gaps == 0);

  SUBCASE("a number that is in two gaps, or is a row, counts once") {
    Gap gap = gap_between(11, 18, std::nullopt);
    gap.tool = shop.tool;
    shop.store(NewGap{gap});
    coverage = shop.coverage();
    CHECK(coverage[0].rows == 5);
    CHECK(coverage[0].in_gaps == 4);
    CHECK(coverage[0].holes == 0);
    CHECK(coverage[0].unknown_gaps == 1);
  }
  SUBCASE("a gap at the end counts") {
    Gap gap = gap_between(18, 21, 2);
    gap.tool = shop.tool;
    gap.at_least = true;
    shop.store(NewGap{gap});
    coverage = shop.coverage();
    CHECK(coverage[0].last == 20);
    CHECK(coverage[0].in_gaps == 4);
    CHECK(coverage[0].unknown_gaps == 1);
  }
}

TEST_CASE("numbers around a wrap are holes unless a gap has them") {
  const Shop shop;
  shop.store(shop.event(65'530));
  NewEvent event = shop.beginning(EpochReason::wrap, 2);
  SUBCASE("no gap") {
    shop.store(event);
    const auto coverage = shop.coverage();
    REQUIRE(coverage.size() == 2);
    CHECK(coverage[0].last == 65'535);
    CHECK(coverage[0].holes == 5);
    CHECK(coverage[1].first == 0);
    CHECK(coverage[1].holes == 2);
  }
  SUBCASE("the gap of the event") {
    event.gap = gap_between(65'530, 2, 7);
    shop.store(event);
    const auto coverage = shop.coverage();
    CHECK(coverage[0].in_gaps == 5);
    CHECK(coverage[0].holes == 0);
    CHECK(coverage[1].in_gaps == 2);
    CHECK(coverage[1].holes == 0);
  }
  SUBCASE("a gap that was stored before the event") {
    Gap gap = gap_between(65'530, 2, 7);
    gap.tool = shop.tool;
    shop.store(NewGap{gap});
    CHECK(shop.last().number == 65'530);
    shop.store(event);
    const auto coverage = shop.coverage();
    CHECK(coverage[0].holes == 0);
    CHECK(coverage[1].holes == 0);
    CHECK(coverage[1].in_gaps == 2);
  }
}

TEST_CASE("where a tool began to count anew its first numbers are not known") {
  const Shop shop;
  shop.store(shop.event(500));
  NewEvent event = shop.beginning(EpochReason::restart, 3);
  event.gap = gap_between(500, 3, 2);
  event.gap->at_least = true;
  shop.store(event);
  const auto coverage = shop.coverage();
  REQUIRE(coverage.size() == 2);
  CHECK(coverage[0].first == 500);
  CHECK(coverage[0].last == 500);
  CHECK(coverage[0].holes == 0);
  CHECK(coverage[1].first == 1);
  CHECK(coverage[1].last == 3);
  CHECK(coverage[1].in_gaps == 2);
  CHECK(coverage[1].holes == 0);
  CHECK(coverage[1].unknown_gaps == 1);
}

// ---- reading ----

TEST_CASE("a filter lets through what it names, in the order of the store") {
  const Shop shop;
  shop.store_numbers(1, 6);
  NewEvent bad = shop.event(7);
  bad.event.kind = "fastening-ng";
  bad.event.columns[Column::preset] = 2;
  const RowId bad_id = shop.store(bad).id;
  shop.store(shop.beginning(EpochReason::restart, 2, 1));
  const auto reader = shop.reader();
  const auto numbers = [&](const Filter& filter) {
    return numbers_of(stored_events(*reader, filter));
  };
  CHECK(numbers({}) == Numbers{1, 2, 3, 4, 5, 6, 7, 2});
  CHECK(numbers({.since = second(3), .until = second(5)}) == Numbers{3, 4});
  CHECK(numbers({.preset = 2}) == Numbers{7});
  CHECK(numbers({.kinds = {"fastening-ng", "it's"}}) == Numbers{7});
  CHECK(numbers({.kinds = {"it's"}}).empty());
  CHECK(numbers({.epoch = 1}) == Numbers{2});
  CHECK(numbers({.number = 2}) == Numbers{2, 2});
  CHECK(numbers({.after = bad_id}) == Numbers{2});
  CHECK(numbers({.newest = 3}) == Numbers{6, 7, 2});
  CHECK(numbers({.tools = {shop.tool}, .newest = 1}) == Numbers{2});
  CHECK(numbers({.tools = {99}}).empty());
  CHECK(numbers({.places = {shop.place, 99}, .until = second(2)}) == Numbers{1});
  CHECK(*reader->newest() == bad_id + 1);

  const Filter torques = {.columns = std::vector{Column::torque}};
  CHECK(reader->events(torques, [&](const EventView& event) {
    CHECK(event.columns[Column::torque] == 27'100 + event.number);
    CHECK_FALSE(event.columns[Column::preset]);
    CHECK(event.raw.empty());
    CHECK(event.source == "push");
    return true;
  }));

  std::size_t taken = 0;
  CHECK(reader->events({}, [&](const EventView& /*event*/) { return ++taken < 2; }));
  CHECK(taken == 2);
}

TEST_CASE("a reader sees what is written while it reads") {
  Shop shop;
  shop.store_numbers(1, 2);
  const auto reader = shop.reader();
  CHECK(stored_events(*reader).size() == 2);
  shop.store_numbers(3, 4);
  CHECK(stored_events(*reader).size() == 4);
  // What is written while it goes through the events is none of them.
  std::size_t seen = 0;
  CHECK(reader->events({}, [&](const EventView& event) {
    if (event.number == 1) shop.store_numbers(5, 6);
    return ++seen < 100;
  }));
  CHECK(seen == 4);
  CHECK(stored_events(*reader).size() == 6);
  shop.writer.reset();
  CHECK(stored_events(*reader).size() == 6);
}

TEST_CASE("a write-ahead log that a reader made long is emptied behind it") {
  const Shop shop;
  shop.store_numbers(1, 2);
  const std::string text = '"' + std::string(1U << 20U, 'x') + '"';
  constexpr int texts = 40;
  constexpr std::uintmax_t long_log = 32U << 20U;
  CHECK(shop.reader()->events({}, [&](const EventView& /*event*/) {
    for (int second_of = 0; second_of < texts; ++second_of) {
      shop.store(Happening{.at = second(second_of), .type = "link", .json = text});
    }
    return false;
  }));
  CHECK(std::filesystem::file_size(shop.path + "-wal") > long_log);
  shop.store_numbers(3, 3);
  CHECK(std::filesystem::file_size(shop.path + "-wal") == 0);
}

TEST_CASE("several threads write") {
  const Shop shop;
  constexpr std::uint16_t events = 50;
  const auto write = [&](const std::string& serial) {
    const auto tool = shop.writer->tool({.maker = "DOGA", .serial = serial}, "");
    const auto place = shop.writer->place({.tool = *tool, .name = serial, .url = "tcp://a"});
    for (std::uint16_t number = 0; number < events; ++number) {
      const Entry entry = new_event(*tool, *place, number);
      static_cast<void>(shop.writer->commit(std::array{entry}));
    }
  };
  std::thread other(write, "a");
  write("b");
  other.join();
  CHECK(stored_events(*shop.reader()).size() == 2 * events);
}

// ---- opening ----

TEST_CASE("the folder is made, and the files are their owner's alone") {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/a/b c%?#/events.db";
  const auto writer = Writer::open(path);
  REQUIRE_MESSAGE(writer, describe(writer.error()));
  REQUIRE((*writer)->tool({.maker = "DOGA", .serial = "1"}, ""));
  for (const std::string ending : {"", ".lock", "-wal"}) {
    CAPTURE(ending);
    struct stat status = {};
    REQUIRE(::stat((path + ending).c_str(), &status) == 0);
    CHECK((status.st_mode & 0777U) == 0600U);
  }
  CHECK(Reader::open(path));
}

TEST_CASE("a second writer is refused and told who writes") {
  Shop shop;
  const auto second_writer = Writer::open(shop.path);
  REQUIRE_FALSE(second_writer);
  CHECK(second_writer.error().code == Errc::storage);
  CHECK(describe(second_writer.error()) ==
        fmt::format("{}: process {} writes it; one program writes a store: end the other one, or "
                    "give another path",
                    shop.path, ::getpid()));
  shop.writer.reset();
  CHECK(Writer::open(shop.path));
}

TEST_CASE("a writer that was killed leaves neither a lock nor half an entry") {
  Shop shop;
  shop.store_numbers(1, 2);
  shop.writer.reset();
  const ::pid_t child = ::fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    auto writer = Writer::open(shop.path);
    const Entry entry = shop.event(3);
    const bool is_stored = writer && (*writer)->commit(std::array{entry}).has_value();
    if (!is_stored) ::_exit(1);
    ::kill(::getpid(), SIGKILL);
  }
  int status = 0;
  REQUIRE(::waitpid(child, &status, 0) == child);
  CHECK(WIFSIGNALED(status));
  CHECK(std::filesystem::file_size(shop.path + "-wal") > 0);
  // A reader alone goes through what the writer left.
  CHECK(numbers_of(stored_events(*shop.reader())) == Numbers{1, 2, 3});
  shop.reopen();
  CHECK(shop.last().number == 3);
  shop.check_integrity();
}

TEST_CASE("a newer store is refused by its number and left alone") {
  Shop shop;
  shop.writer.reset();
  run_sql(shop.path, "PRAGMA user_version = 7");
  const std::string before = content_of(shop.path);
  const auto writer = Writer::open(shop.path);
  REQUIRE_FALSE(writer);
  CHECK(writer.error().code == Errc::bad_file);
  CHECK(message_of(writer.error()) ==
        "is a store of version 7, this program knows versions up to 3");
  const auto reader = Reader::open(shop.path);
  REQUIRE_FALSE(reader);
  CHECK(message_of(reader.error()) == message_of(writer.error()));
  CHECK(content_of(shop.path) == before);
}

TEST_CASE("what is no store is refused and never touched") {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/other.db";
  std::string expected;
  SUBCASE("the database of another program") {
    run_sql(path, "PRAGMA application_id = 7; CREATE TABLE t (a); INSERT INTO t VALUES (1)");
    expected = "is a database of another program";
  }
  SUBCASE("a database whose program did not say which it is") {
    run_sql(path, "PRAGMA journal_mode = WAL; CREATE TABLE t (a)");
    expected = "is a database of another program";
  }
  SUBCASE("a text") {
    folder.write("other.db", std::string(5'000, 'x'));
    expected = "is no store (file is not a database)";
  }
  SUBCASE("a short text") {
    folder.write("other.db", "short");
    expected = "is no store (file is not a database)";
  }
  const std::string before = content_of(path);
  const auto writer = Writer::open(path);
  REQUIRE_FALSE(writer);
  CHECK(writer.error().code == Errc::bad_file);
  CHECK(message_of(writer.error()) == expected);
  const auto reader = Reader::open(path);
  REQUIRE_FALSE(reader);
  CHECK(message_of(reader.error()) == expected);
  CHECK(content_of(path) == before);
  CHECK_FALSE(std::filesystem::exists(path + "-wal"));
}

TEST_CASE("a store that is not there is made by a writer, not by a reader") {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/events.db";
  const auto missing = Reader::open(path);
  REQUIRE_FALSE(missing);
  CHECK(missing.error().code == Errc::bad_file);
  CHECK(message_of(missing.error()) == "there is no store");
  CHECK_FALSE(std::filesystem::exists(path));
  // What a crash leaves that came before anything was stored.
  folder.write("events.db", "");
  CHECK_FALSE(Reader::open(path));
  CHECK(Writer::open(path));
  CHECK(Reader::open(path));
}

TEST_CASE("where a store cannot be made, the error says why") {
  const TemporaryFolder folder;
  const std::string file = folder.write("file", "x");
  const auto writer = Writer::open(file + "/events.db");
  REQUIRE_FALSE(writer);
  CHECK(writer.error().code == Errc::storage);
  CHECK(describe(writer.error()) ==
        file +
            ": the folder cannot be made: Not a directory; check the rights of the folder, and "
            "the disk");
}

TEST_CASE("network file systems are known by their names") {
  CHECK(network_file_system(0x6969) == "NFS");
  CHECK(network_file_system(0xFF534D42) == "SMB");
  CHECK(network_file_system(0xEF53).empty());
}

// ---- care ----

TEST_CASE("a damaged store is told line by line") {
  Shop shop;
  shop.store_numbers(1, 300);
  shop.writer.reset();
  SUBCASE("rows that contradict each other") {
    run_sql(shop.path,
            "UPDATE event SET raw = x'00' WHERE number = 7; UPDATE event SET kind = '' WHERE "
            "number = 8; INSERT INTO gap VALUES (5, 1, 0, 300, 299, 1, 0, 0, 0, 'x'); DELETE FROM "
            "event WHERE number = 299; UPDATE event SET place = 9 WHERE number = 10");
    const auto findings = shop.reader()->integrity();
    REQUIRE(findings);
    CHECK(*findings == std::vector<std::string>{"event 10: what it refers to in place is missing",
                                                "event 7: its bytes are no whole registers",
                                                "event 8: it has no kind",
                                                "gap 5: the event that ends it is missing"});
  }
  SUBCASE("pages that are no pages") {
    const auto size = std::filesystem::file_size(shop.path);
    std::fstream file(shop.path, std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(static_cast<std::streamoff>(size / 2));
    file << std::string(8'192, '\xFF');
    file.close();
    const auto reader = shop.reader();
    const auto findings = reader->integrity();
    REQUIRE(findings);
    CHECK_FALSE(findings->empty());
  }
}

TEST_CASE("a backup is whole, and made while others write") {
  const Shop shop;
  shop.store_numbers(1, 20);
  const std::string copy = shop.folder.path() + "/copy.db";
  const auto reader = shop.reader();
  REQUIRE(reader->backup(copy));
  shop.store_numbers(21, 22);
  const auto of_copy = Reader::open(copy);
  REQUIRE_MESSAGE(of_copy, describe(of_copy.error()));
  CHECK(stored_events(**of_copy).size() == 20);
  CHECK((*of_copy)->integrity()->empty());
  struct stat status = {};
  REQUIRE(::stat(copy.c_str(), &status) == 0);
  CHECK((status.st_mode & 0777U) == 0600U);
  const auto again = reader->backup(copy);
  REQUIRE_FALSE(again);
  CHECK(again.error().code == Errc::usage);
  CHECK(describe(again.error()) == copy + ": is there already");
  CHECK(reader->backup(shop.folder.path() + "/missing/copy.db").error().code == Errc::storage);
}

TEST_CASE("trimming takes what is older, but for the last of each tool") {
  Shop shop;
  const RowId other = *shop.writer->tool({.maker = "DOGA", .serial = "2"}, "");
  const RowId place = *shop.writer->place({.tool = other, .name = "b", .url = "tcp://b"});
  shop.store(new_event(other, place, 3));
  shop.store(new_event(other, place, 4));
  shop.store_numbers(1, 4);
  NewEvent event = shop.event(7);
  event.gap = gap_between(4, 7, 2);
  shop.store(event);
  shop.store_numbers(8, 12);
  Gap behind = gap_between(12, 15, 2);
  behind.tool = shop.tool;
  shop.store(NewGap{behind});
  shop.store(Happening{.at = second(1), .type = "start", .json = "{}"});

  const auto trimmed = shop.writer->trim(second(10), second(1'000));
  REQUIRE_MESSAGE(trimmed, describe(trimmed.error()));
  CHECK(trimmed->events == 8);
  CHECK(trimmed->gaps == 1);
  CHECK(trimmed->happenings == 1);
  const auto reader = shop.reader();
  CHECK(numbers_of(stored_events(*reader, {.tools = {shop.tool}})) == Numbers{10, 11, 12});
  CHECK(numbers_of(stored_events(*reader, {.tools = {other}})) == Numbers{4});
  CHECK(shop.last().number == 14);
  std::vector<std::string> lines;
  CHECK(reader->happenings({}, [&](const Happening& happening) {
    lines.push_back(happening.json);
    return true;
  }));
  CHECK(lines == std::vector<std::string>{
                     R"({"schema":"spindle/1","type":"trim","time":"2026-05-28T20:43:20.000Z",)"
                     R"("target":null,"before":"2026-05-28T20:26:50.000Z","events":8,"gaps":1,)"
                     R"("happenings":1})"});
  const auto coverage = shop.coverage();
  CHECK(coverage.at(0).holes == 0);
  shop.check_integrity();

  // No id is given twice.
  const RowId newest = *reader->newest();
  CHECK(shop.store(shop.event(20)).id > newest);
}

TEST_CASE("trimming leaves no holes, whatever the clock was") {
  const Shop shop;
  const auto store_at = [&](std::uint16_t number, WallTime at) {
    NewEvent entry = shop.event(number);
    entry.event.at = at;
    shop.store(entry);
  };
  store_at(1, second(1));
  store_at(2, second(9'999));  // from the future
  store_at(3, second(3));
  store_at(4, second(20));
  store_at(5, second(0));  // the clock was not set yet
  store_at(6, second(21));
  REQUIRE(shop.writer->trim(second(10), second(30)));
  CHECK(numbers_of(stored_events(*shop.reader())) == Numbers{4, 5, 6});
}

TEST_CASE("numbers that were trimmed away before a wrap are no holes") {
  const Shop shop;
  shop.store(shop.event(65'535));
  for (const std::uint16_t number : Numbers{0, 1, 2}) {
    NewEvent entry = shop.event(number);
    entry.event.at = second(70'000 + number);
    if (number == 0) entry.begins = EpochReason::wrap;
    shop.store(entry);
  }
  REQUIRE(shop.writer->trim(second(70'001), second(80'000)));
  const auto coverage = shop.coverage();
  REQUIRE(coverage.size() == 1);
  CHECK(coverage[0].epoch == 1);
  CHECK(coverage[0].first == 1);
  CHECK(coverage[0].holes == 0);
}

TEST_CASE("what a sink has not got is not trimmed away") {
  const Shop shop;
  shop.store_numbers(1, 10);
  run_sql(shop.path,
          "INSERT INTO sink (name, cursor, url, moved) VALUES ('fast', 10, '', 0), ('plant', 4, "
          "'', 0)");
  const auto refused = shop.writer->trim(second(6), second(100));
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == Errc::usage);
  CHECK(message_of(refused.error()) == "sink 'plant' has not got all that is older");
  CHECK(stored_events(*shop.reader()).size() == 10);
  const auto trimmed = shop.writer->trim(second(5), second(100));
  REQUIRE(trimmed);
  CHECK(trimmed->events == 4);
}
