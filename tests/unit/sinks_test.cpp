#include "spindle/store/sinks.hpp"

#include <doctest/doctest.h>
#include <fmt/format.h>
#include <sqlite3.h>
#include <unistd.h>

#include <memory>
#include <string>
#include <vector>

#include "spindle/store/reader.hpp"
#include "spindle/store/writer.hpp"
#include "support/store_entries.hpp"
#include "support/temporary_folder.hpp"

using namespace spindle;
using namespace spindle::store;
using spindle::test::new_event;
using spindle::test::second;
using spindle::test::TemporaryFolder;

namespace {

void run_sql(const std::string& path, const std::string& sql) {
  sqlite3* database = nullptr;
  REQUIRE(sqlite3_open(path.c_str(), &database) == SQLITE_OK);
  const int answer = sqlite3_exec(database, sql.c_str(), nullptr, nullptr, nullptr);
  CHECK_MESSAGE(answer == SQLITE_OK, sqlite3_errmsg(database));
  sqlite3_close(database);
}

/// A store with ten events, a gap and a happening of one tool.
struct Shop {
  TemporaryFolder folder = {};
  std::string path = folder.path() + "/events.db";
  std::unique_ptr<Writer> writer = std::move(*Writer::open(path));
  RowId tool = *writer->tool({.maker = "DOGA", .serial = "7"}, "BM");
  RowId place = *writer->place({.tool = tool,
                                .name = "station3",
                                .url = "tcp://a",
                                .profile = "doga-bm",
                                .since = second(0)});

  Shop() {
    std::vector<Entry> entries;
    for (std::uint16_t number = 1; number <= 10; ++number) {
      entries.emplace_back(new_event(tool, place, number));
    }
    entries.emplace_back(NewGap{{.tool = tool,
                                 .after = 10,
                                 .before = 12,
                                 .missed = 1,
                                 .began = second(11),
                                 .ended = second(11),
                                 .reason = "jump"}});
    entries.emplace_back(
        Happening{.tool = tool, .at = second(12), .type = "link", .json = R"({"a":1})"});
    REQUIRE(writer->commit(entries));
  }

  [[nodiscard]] std::unique_ptr<Reader> reader() const { return std::move(*Reader::open(path)); }
  [[nodiscard]] std::unique_ptr<SinkCursor> cursor(const std::string& name) const {
    auto opened = SinkCursor::open(path, name);
    REQUIRE_MESSAGE(opened, describe(opened.error()));
    return std::move(*opened);
  }

  /// As a program of before there were places of gaps and happenings left it.
  void make_old() {
    writer.reset();
    run_sql(path,
            "ALTER TABLE sink DROP COLUMN gap; ALTER TABLE sink DROP COLUMN happening;"
            "ALTER TABLE place DROP COLUMN fence;"
            "PRAGMA user_version = 1");
  }
};

}  // namespace

TEST_CASE("a sink's place is stored beside a writer, and read again") {
  const Shop shop;
  {
    const auto cursor = shop.cursor("plant");
    CHECK(cursor->is_new());
    CHECK(cursor->row().positions == Positions());
    REQUIRE(cursor->move({.event = 4, .gap = 1}, "mqtt://a", second(20)));
    CHECK_FALSE(cursor->is_new());
    REQUIRE(shop.writer->commit(std::vector<Entry>{new_event(shop.tool, shop.place, 13)}));
    REQUIRE(cursor->move({.event = 6, .gap = 1, .happening = 1}, "mqtt://b", second(21)));
  }
  const auto cursor = shop.cursor("plant");
  CHECK_FALSE(cursor->is_new());
  CHECK(cursor->row().positions == Positions{.event = 6, .gap = 1, .happening = 1});
  const auto sinks = shop.reader()->sinks();
  REQUIRE(sinks);
  REQUIRE(sinks->size() == 1);
  CHECK(sinks->front().url == "mqtt://b");
  CHECK(sinks->front().moved == second(21));
}

TEST_CASE("one program serves a sink, and its message names it") {
  const Shop shop;
  const auto first = shop.cursor("plant");
  const auto second_one = SinkCursor::open(shop.path, "plant");
  REQUIRE_FALSE(second_one);
  CHECK(message_of(second_one.error()) ==
        fmt::format("process {} forwards to sink 'plant'", ::getpid()));
  CHECK_FALSE(forget_sink(shop.path, "plant"));
  CHECK(SinkCursor::open(shop.path, "mqtt://a/b"));  // another one, whatever its name has in it
}

TEST_CASE("a store of version 1 is brought up to date, and its sink keeps its place") {
  Shop shop;
  shop.make_old();
  run_sql(shop.path, "INSERT INTO sink (name, cursor, url, moved) VALUES ('plant', 4, 'u', 0)");
  {
    const auto sinks = shop.reader()->sinks();  // a reader changes nothing
    REQUIRE(sinks);
    CHECK(sinks->front().positions == Positions{.event = 4});
  }
  SUBCASE("by who serves a sink") {
    const auto cursor = shop.cursor("plant");
    CHECK(cursor->row().positions == Positions{.event = 4});
    CHECK(cursor->move({.event = 5, .gap = 1, .happening = 1}, "u", second(30)));
  }
  SUBCASE("by who writes") {
    shop.writer = std::move(*Writer::open(shop.path));
    CHECK(shop.cursor("plant")->row().positions == Positions{.event = 4});
  }
}

TEST_CASE("an old store that is written is not changed under its writer") {
  Shop shop;
  shop.make_old();
  const auto writer = Writer::open(shop.path);
  REQUIRE(writer);
  run_sql(shop.path, "PRAGMA user_version = 1");  // as if an older program wrote it
  const auto cursor = SinkCursor::open(shop.path, "plant");
  REQUIRE_FALSE(cursor);
  CHECK(message_of(cursor.error()) ==
        fmt::format("is of an older version, and process {} writes it", ::getpid()));
}

TEST_CASE("gaps and happenings that a sink has not got are not trimmed away") {
  const Shop shop;
  const auto cursor = shop.cursor("plant");
  REQUIRE(cursor->move({.event = 10}, "u", second(20)));
  std::vector<Entry> more;
  for (std::uint16_t number = 12; number <= 14; ++number) {
    more.emplace_back(new_event(shop.tool, shop.place, number));
  }
  REQUIRE(shop.writer->commit(more));
  CHECK_FALSE(shop.writer->trim(second(13), second(100)));
  REQUIRE(cursor->move({.event = 11, .gap = 1}, "u", second(20)));
  CHECK_FALSE(shop.writer->trim(second(13), second(100)));
  REQUIRE(cursor->move({.event = 11, .gap = 1, .happening = 1}, "u", second(20)));
  const auto trimmed = shop.writer->trim(second(13), second(100));
  REQUIRE_MESSAGE(trimmed, describe(trimmed.error()));
  CHECK(trimmed->events == 11);
  CHECK(trimmed->gaps == 1);
  CHECK(trimmed->happenings == 1);
}

TEST_CASE("a sink that was forgotten holds back nothing") {
  const Shop shop;
  REQUIRE(shop.cursor("plant")->move({}, "u", second(20)));
  CHECK_FALSE(shop.writer->trim(second(5), second(100)));
  CHECK(*forget_sink(shop.path, "plant"));
  CHECK_FALSE(*forget_sink(shop.path, "plant"));
  CHECK(shop.writer->trim(second(5), second(100)));
}

TEST_CASE("what is behind a place, and where times and ends are") {
  const Shop shop;
  const auto reader = shop.reader();
  const auto behind = reader->behind({.event = 4});
  REQUIRE(behind);
  CHECK(behind->events == 6);
  CHECK(behind->gaps == 1);
  CHECK(behind->happenings == 1);
  CHECK(behind->oldest == second(5));
  CHECK_FALSE(reader->behind({.event = 10, .gap = 1})->oldest);
  CHECK(*reader->ends() == Positions{.event = 10, .gap = 1, .happening = 1});
  CHECK(*reader->before(second(4)) == Positions{.event = 3, .gap = 0, .happening = 0});
  CHECK(*reader->before(second(99)) == Positions{.event = 10, .gap = 1, .happening = 1});
  const std::vector<std::string> kinds = {"fastening-ok"};
  const auto before = reader->counted_before(shop.tool, {.epoch = 0, .number = 4}, kinds);
  REQUIRE(before);
  REQUIRE(*before);
  CHECK((*before)->number == 3);
  CHECK_FALSE(*reader->counted_before(shop.tool, {.epoch = 0, .number = 1}, kinds));
}

TEST_CASE("a reader notices what another program stored") {
  const Shop shop;
  const auto reader = shop.reader();
  const auto before = reader->state();
  CHECK(*reader->state() == *before);
  REQUIRE(shop.cursor("plant")->move({.event = 1}, "u", second(20)));
  CHECK(*reader->state() != *before);
}
