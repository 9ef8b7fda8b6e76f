#include "commands/leases.hpp"

#include <doctest/doctest.h>

#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "spindle/store/reader.hpp"
#include "spindle/store/writer.hpp"
#include "spindle/work/lease_lines.hpp"
#include "support/store_entries.hpp"
#include "support/temporary_folder.hpp"

using namespace spindle;
using namespace std::chrono_literals;
using spindle::test::new_event;
using spindle::test::second;
using work::LeaseLine;

namespace {

/// Long for a machine that others keep busy; no test waits for it to pass.
constexpr auto patience = 60s;

/// Time that the test moves while other threads look at it.
class MovedClock final : public Clock {
 public:
  [[nodiscard]] TimePoint now() const override {
    const std::lock_guard lock(mutex_);
    return now_;
  }
  [[nodiscard]] WallTime wall() const override { return {}; }
  Result<void> sleep_until(TimePoint) override { return {}; }
  void advance(Duration by) {
    const std::lock_guard lock(mutex_);
    now_ += by;
  }

 private:
  mutable std::mutex mutex_ = {};
  TimePoint now_ = TimePoint(1h);
};

/// What the other program is told, and what it says.
class Desk {
 public:
  std::function<std::vector<std::string>(const LeaseLine&)> answer = {};

  std::unique_ptr<LineChannel> open() {
    const std::lock_guard lock(mutex_);
    ++starts_;
    return std::make_unique<Channel>(*this);
  }
  int starts() {
    const std::lock_guard lock(mutex_);
    return starts_;
  }
  /// Waits until a question was asked so many times.
  bool asked(const std::string& verb, int times) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, patience, [&] { return asked_[verb] >= times; });
  }
  int times(const std::string& verb) {
    const std::lock_guard lock(mutex_);
    return asked_[verb];
  }
  void say(std::vector<std::string> lines) {
    const std::lock_guard lock(mutex_);
    lines_ = std::move(lines);
    is_silent_ = false;
  }
  void fall_silent() {
    const std::lock_guard lock(mutex_);
    is_silent_ = true;
  }

 private:
  class Channel final : public LineChannel {
   public:
    explicit Channel(Desk& desk) : desk_(&desk) {}
    Result<void> send(std::string_view line) override {
      const auto question = work::lease_line_of(line);
      REQUIRE(question);
      const std::lock_guard lock(desk_->mutex_);
      ++desk_->asked_[question->verb];
      if (!desk_->is_silent_) {
        for (const std::string& text : desk_->lines_) {
          waiting_.push_back(text.substr(0, text.find(' ')) + " " + std::to_string(question->id) +
                             text.substr(text.find(' ')));
        }
      }
      desk_->changed_.notify_all();
      return {};
    }
    Result<std::optional<std::string>> receive(TimePoint) override {
      if (waiting_.empty()) return std::optional<std::string>();
      std::string line = std::move(waiting_.front());
      waiting_.pop_front();
      return line;
    }

   private:
    Desk* desk_;
    std::deque<std::string> waiting_ = {};
  };

  std::mutex mutex_ = {};
  std::condition_variable changed_ = {};
  std::map<std::string, int> asked_ = {};
  std::vector<std::string> lines_ = {};
  bool is_silent_ = true;
  int starts_ = 0;
};

struct Bench {
  MovedClock clock = {};
  Interrupt interrupt = Interrupt();
  Desk desk = {};
  std::unique_ptr<commands::Leases> leases = std::make_unique<commands::Leases>(
      [this]() -> Result<std::unique_ptr<LineChannel>> { return desk.open(); }, 1s, clock,
      interrupt, [](const std::string&) {});

  /// Two more renewals: the one before the last was taken.
  void renew() { REQUIRE(desk.asked("hold", desk.times("hold") + 2)); }
};

}  // namespace

TEST_CASE("words of any kind cross a line") {
  const LeaseLine line = {"hold", 7, {"1000", "a b", "", "50%", "line\n"}};
  const auto read = work::lease_line_of(work::to_line(line));
  REQUIRE(read);
  CHECK(read->verb == line.verb);
  CHECK(read->id == line.id);
  CHECK(read->words == line.words);
  CHECK(work::to_line(line).find('\n') == std::string::npos);
  for (const char* bad : {"", "hold", "hold x", " 7", "hold 7 %", "hold 7 %4", "hold 7 %zz"}) {
    CAPTURE(bad);
    const bool is_empty_word = std::string(bad) == "hold 7 %";
    CHECK(work::lease_line_of(bad).has_value() == is_empty_word);
  }
}

TEST_CASE("the last event of a tool crosses a line") {
  store::Last last{.epoch = 3, .number = 65'535, .block = Registers{1, 0xFFFF}, .seen = second(5)};
  auto read = work::last_of(work::words_of(last));
  REQUIRE(read);
  CHECK(read->epoch == 3);
  CHECK(read->number == 65'535);
  CHECK(read->block == last.block);
  CHECK(read->seen == last.seen);
  last.block.reset();
  read = work::last_of(work::words_of(last));
  REQUIRE(read);
  CHECK_FALSE(read->block);
  CHECK_FALSE(work::last_of({"1", "65536", "0", "-"}));
  CHECK_FALSE(work::last_of({"1", "2", "0", "12"}));
  CHECK_FALSE(work::last_of({"1", "2", "0"}));
}

TEST_CASE("what the database says is held is held until before its end") {
  Bench bench;
  bench.desk.say({"held a 4 b 9"});
  CHECK(bench.leases->held().empty());
  bench.leases->want({"a", "b", "c"});
  bench.renew();
  CHECK(bench.leases->held() == std::set<std::string>{"a", "b"});
  CHECK(bench.leases->fence("b") == 9);
  CHECK_FALSE(bench.leases->fence("c"));
  bench.desk.say({"held b 9"});
  bench.renew();
  CHECK(bench.leases->held() == std::set<std::string>{"b"});
}

TEST_CASE("a program that falls silent loses all before another can have them") {
  Bench bench;
  bench.desk.say({"held a 1"});
  bench.leases->want({"a"});
  bench.renew();
  bench.desk.fall_silent();
  REQUIRE(bench.desk.asked("hold", bench.desk.times("hold") + 1));
  bench.clock.advance(550ms);
  CHECK(bench.leases->held().size() == 1);
  bench.clock.advance(60ms);
  CHECK(bench.leases->held().empty());
  // It is started anew, and goes on.
  bench.desk.say({"held a 2"});
  bench.clock.advance(60s);
  bench.renew();
  CHECK(bench.desk.starts() == 2);
  CHECK(bench.leases->fence("a") == 2);
}

TEST_CASE("without the database nothing is taken, and nothing is believed") {
  Bench bench;
  bench.desk.say({"failed no%20route"});
  bench.leases->want({"a"});
  bench.renew();
  CHECK(bench.leases->held().empty());
  const auto last = bench.leases->last({"DOGA", "42"});
  REQUIRE_FALSE(last);
  CHECK(last.error().status() == ExitStatus::storage);
  bench.desk.say({"nothing "});
  CHECK(bench.leases->last({"DOGA", "42"}).has_value());
  bench.desk.say({"told 2 17 5 00010002"});
  const auto known = bench.leases->last({"DOGA", "42"});
  REQUIRE(known);
  REQUIRE(*known);
  CHECK((*known)->number == 17);
}

TEST_CASE("a store goes on behind what another collector recorded") {
  const test::TemporaryFolder folder;
  auto writer = store::Writer::open(folder.path() + "/events.db").value();
  const store::RowId tool = writer->tool({"DOGA", "42"}, "BM").value();
  const store::RowId place =
      writer->place({.tool = tool, .name = "a", .url = "b", .profile = "c"}).value();
  const auto add = [&](std::uint16_t number) {
    const store::Entry entry = new_event(tool, place, number);
    return writer->commit({&entry, 1}).value().front();
  };
  add(1962);
  add(1963);
  SUBCASE("in its epoch") {
    REQUIRE(writer->adopt(tool, {.epoch = 0, .number = 1970, .seen = second(1970)}));
    CHECK(writer->last(tool).value()->number == 1970);
    // The same once more, and what is older, say nothing new.
    REQUIRE(writer->adopt(tool, {.epoch = 0, .number = 1970, .seen = second(1970)}));
    REQUIRE(writer->adopt(tool, {.epoch = 0, .number = 1963, .seen = second(1963)}));
    // The next one is missing, too: the gap of that ends elsewhere.
    store::NewEvent entry = new_event(tool, place, 1975);
    entry.gap =
        store::Gap{.after = 1970, .before = 1975, .missed = 4, .reason = "the link was lost"};
    const store::Entry next = entry;
    CHECK(writer->commit({&next, 1}).value().front().epoch == 0);
    auto reader = store::Reader::open(folder.path() + "/events.db").value();
    const auto gaps = reader->gaps({}).value();
    REQUIRE(gaps.size() == 2);
    CHECK(gaps[0].after == 1963);
    CHECK(gaps[0].before == 1971);
    CHECK(gaps[0].missed == 7);
    CHECK(gaps[0].reason == store::recorded_elsewhere);
    CHECK(reader->coverage().value().front().holes == 0);
    CHECK(reader->integrity().value().empty());
  }
  SUBCASE("in a later one") {
    REQUIRE(writer->adopt(tool, {.epoch = 3, .number = 5, .seen = second(1970)}));
    CHECK(writer->last(tool).value()->epoch == 3);
    CHECK(add(6).epoch == 3);
    auto reader = store::Reader::open(folder.path() + "/events.db").value();
    CHECK(reader->integrity().value().empty());
  }
  SUBCASE("at the highest number") {
    REQUIRE(writer->adopt(tool, {.epoch = 1, .number = 65'535, .seen = second(1970)}));
    CHECK(add(0).epoch == 1);
  }
}
