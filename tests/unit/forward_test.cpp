#include <doctest/doctest.h>
#include <fmt/format.h>

#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "forward/backoff.hpp"
#include "forward/mqtt_topics.hpp"
#include "forward/mqtt_words.hpp"
#include "forward/outbox.hpp"
#include "spindle/store/writer.hpp"
#include "support/store_entries.hpp"
#include "support/temporary_folder.hpp"

using namespace spindle;
using namespace spindle::forward;
using namespace std::chrono_literals;
using spindle::test::new_event;
using spindle::test::second;

TEST_CASE("a tool's name becomes one level of a topic") {
  struct Row {
    std::string name;
    std::string level;
  };
  const Row rows[] = {
      {"station3", "station3"},
      {"", "%"},
      {"a/b", "a%2Fb"},
      {"+", "%2B"},
      {"#", "%23"},
      {"$SYS", "%24SYS"},
      {"100%", "100%25"},
      {"%2F", "%252F"},
      {"_collector", "%5Fcollector"},
      {"a_b", "a_b"},
      {"left hand", "left%20hand"},
      {std::string("a\0b", 3), "a%00b"},
      {"a\x01\x7F", "a%01%7F"},
      {"Schrauber-ä", "Schrauber-ä"},
      {"\xFF", "%FF"},
      {"\xC2\x85", "%C2%85"},         // a control character of two bytes
      {"\xEF\xBF\xBF", "%EF%BF%BF"},  // no character at all
  };
  std::set<std::string> levels;
  for (const Row& row : rows) {
    CAPTURE(row.name);
    CHECK(level_of(row.name) == row.level);
    CHECK(levels.insert(level_of(row.name)).second);
  }
}

TEST_CASE("a very long name keeps its beginning and stays another one") {
  const std::string a = level_of(std::string(300, 'a'));
  const std::string b = level_of(std::string(299, 'a') + "b");
  CHECK(a.size() < 200);
  CHECK(a.starts_with("aaaa"));
  CHECK(a != b);
  CHECK(level_of(std::string(200, 'a')) == std::string(200, 'a'));
  std::string umlauts;
  for (int times = 0; times < 200; ++times) umlauts += "ä";
  CHECK(level_of(umlauts).find("ä%~") != std::string::npos);  // cut between two characters
}

TEST_CASE("topics") {
  const Topics topics("acme/line1");
  CHECK(topics.of_tool("station3", "result") == "acme/line1/station3/result");
  CHECK(topics.of_collector("host 1") == "acme/line1/_collector/host%201/status");
}

TEST_CASE("reasons in words") {
  CHECK(reason_in_words(135) == "not authorized (135)");
  CHECK(reason_in_words(151) == "quota exceeded (151)");
  CHECK(reason_in_words(200) == "unknown reason (200)");
}

TEST_CASE("keys name a row for ever") {
  Parcel parcel = {.tool = {.maker = "DOGA", .serial = "7"}, .epoch = 2};
  parcel.row = store::Event{.number = 9};
  CHECK(key_of(parcel) == "DOGA/7/2/9");
  parcel.tool.serial = "@a/b%\x01";
  CHECK(key_of(parcel) == "DOGA/@a%2Fb%25%01/2/9");
  parcel.tool.serial = "7";
  parcel.row = store::Gap{.after = 4, .before = 9, .reason = "jump"};
  CHECK(key_of(parcel) == "DOGA/7/2/gap/4-9/jump");
  parcel.row = store::Gap{.began = WallTime(5s), .reason = "offline"};
  CHECK(key_of(parcel) == "DOGA/7/2/gap/5000/offline");
  CHECK(sequence_number(2, 9) == 131'081);
}

TEST_CASE("pauses grow to half a minute, and no two are the same") {
  Backoff backoff(1);
  Duration longest = 500ms;
  for (int failure = 0; failure < 12; ++failure) {
    const Duration pause = backoff.next();
    CHECK(pause >= longest / 2);
    CHECK(pause <= longest);
    longest = std::min<Duration>(2 * longest, 30s);
  }
  backoff.reset();
  CHECK(backoff.next() <= 500ms);
  CHECK(Backoff(1).next() != Backoff(2).next());
}

namespace {

/// Rows told by their ids alone.
class PlainRows final : public commands::StoredRows {
 public:
  explicit PlainRows(const std::string& path) : reader_(std::move(*store::Reader::open(path))) {}

  store::Reader& reader() override { return *reader_; }
  Result<void> refresh() override {
    tools_ = *reader_->tools();
    places_ = *reader_->places();
    return {};
  }
  report::Record event(const store::EventView& row) override {
    return {.type = "event", .target = {}, .time = row.at, .fields = {}};
  }
  report::Record gap(const store::Gap& row) override {
    return {.type = "gap", .target = {}, .time = row.ended, .fields = {}};
  }
  report::Record happening(const store::Happening& row) override {
    return {.type = row.type, .target = {}, .time = row.at, .fields = {}};
  }
  [[nodiscard]] const store::Tool* tool(store::RowId id) const override { return find(tools_, id); }
  [[nodiscard]] const store::Place* place(store::RowId id) const override {
    return find(places_, id);
  }
  [[nodiscard]] const store::Place* place_at(store::RowId, WallTime) const override {
    return places_.empty() ? nullptr : &places_.front();
  }

 private:
  template <typename Row>
  static const Row* find(const std::vector<Row>& rows, store::RowId id) {
    for (const Row& row : rows) {
      if (row.id == id) return &row;
    }
    return nullptr;
  }

  std::unique_ptr<store::Reader> reader_;
  std::vector<store::Tool> tools_ = {};
  std::vector<store::Place> places_ = {};
};

struct Rig {
  test::TemporaryFolder folder = {};
  std::string path = folder.path() + "/events.db";
  std::unique_ptr<store::Writer> writer = std::move(*store::Writer::open(path));
  store::RowId tool = *writer->tool({.maker = "DOGA", .serial = "7"}, "BM");
  store::RowId place = *writer->place({.tool = tool,
                                       .name = "station3",
                                       .url = "tcp://a",
                                       .profile = "doga-bm",
                                       .since = second(0)});
  PlainRows rows{path};

  void tell(std::uint16_t number, const std::string& kind = "fastening-ok",
            std::optional<std::uint16_t> missed_behind = std::nullopt) const {
    store::NewEvent entry = new_event(tool, place, number);
    entry.event.kind = kind;
    if (missed_behind) {
      entry.gap = store::Gap{.after = *missed_behind,
                             .before = number,
                             .missed = number - *missed_behind - 1,
                             .began = second(*missed_behind),
                             .ended = entry.event.at,
                             .reason = "jump"};
    }
    REQUIRE(writer->commit(std::vector<store::Entry>{entry}));
  }
  void happen(std::int64_t at) const {
    REQUIRE(writer->commit(std::vector<store::Entry>{store::Happening{
        .tool = tool, .at = second(at), .type = "link", .json = R"({"type":"link"})"}}));
  }
};

/// "event 3 after -, gap 1".
std::string told(const Outbox& outbox, std::size_t most = 100) {
  std::string text;
  for (const Parcel& parcel : outbox.front(most)) {
    if (!text.empty()) text += ", ";
    if (parcel.event() != nullptr) {
      text += fmt::format("event {} after {}", parcel.event()->number,
                          parcel.previous ? fmt::format("{}", *parcel.previous) : "-");
    } else {
      text += fmt::format("{} {}", parcel.gap() != nullptr ? "gap" : "happening", parcel.id);
    }
  }
  return text;
}

bool all(const Parcel&) { return true; }
bool results(const Parcel& parcel) { return parcel.gap() != nullptr || parcel.is_result; }

}  // namespace

TEST_CASE("rows go out by their time, a gap before the event that made it known") {
  Rig rig;
  rig.happen(0);
  rig.tell(1);
  rig.tell(2);
  rig.tell(5, "fastening-ng", 2);
  Outbox outbox(rig.rows, "here", all, {});
  REQUIRE(outbox.fill(100));
  CHECK(told(outbox) == "happening 1, event 1 after -, event 2 after 1, gap 1, event 5 after 2");
  const auto front = outbox.front(100);
  CHECK(front[4].json.ends_with(R"("seq":5,"previous":2,"collector":"here"})"));
  CHECK(front[4].target == "station3");
  CHECK(front[4].tool.serial == "7");
}

TEST_CASE("a sink's place moves with what it acknowledged, and over what it does not want") {
  Rig rig;
  rig.happen(0);
  rig.tell(1, "preset-change");
  rig.tell(2);
  rig.tell(3, "preset-change");
  rig.tell(4);
  rig.happen(9);
  Outbox outbox(rig.rows, "here", results, {});
  REQUIRE(outbox.fill(100));
  CHECK(told(outbox) == "event 2 after -, event 4 after 2");
  CHECK(outbox.positions() == store::Positions{.event = 1, .happening = 1});
  outbox.acknowledge(1);
  CHECK(outbox.positions() == store::Positions{.event = 3, .happening = 1});
  CHECK(told(outbox) == "event 4 after 2");
  outbox.acknowledge(1);
  CHECK(outbox.empty());
  CHECK(outbox.positions() == store::Positions{.event = 4, .happening = 2});
}

TEST_CASE("what is stored meanwhile follows, and behind an end nothing") {
  Rig rig;
  rig.tell(1);
  rig.tell(2);
  Outbox outbox(rig.rows, "here", results, {.event = 1});
  Outbox bounded(rig.rows, "here", results, {}, store::Positions{.event = 1});
  REQUIRE(outbox.fill(100));
  REQUIRE(bounded.fill(100));
  CHECK(told(outbox) == "event 2 after 1");  // known from what lies before its place
  rig.tell(3);
  REQUIRE(outbox.fill(1));
  CHECK(told(outbox) == "event 2 after 1");
  REQUIRE(outbox.fill(100));
  CHECK(told(outbox) == "event 2 after 1, event 3 after 2");
  REQUIRE(bounded.fill(100));
  CHECK(told(bounded) == "event 1 after -");
}

TEST_CASE("a long way behind, all of it goes out once and in order") {
  Rig rig;
  std::vector<store::Entry> entries;
  constexpr std::uint16_t last = 2'000;
  for (std::uint16_t number = 1; number <= last; ++number) {
    entries.emplace_back(new_event(rig.tool, rig.place, number));
  }
  REQUIRE(rig.writer->commit(entries));
  Outbox outbox(rig.rows, "here", results, {});
  std::uint16_t next = 1;
  while (true) {
    REQUIRE(outbox.fill(70));
    if (outbox.empty()) break;
    const auto front = outbox.front(33);
    for (const Parcel& parcel : front) CHECK(parcel.event()->number == next++);
    outbox.acknowledge(front.size());
    CHECK(outbox.positions().event == next - 1);
  }
  CHECK(next == last + 1);
}
