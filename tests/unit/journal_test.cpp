#include "spindle/work/journal.hpp"

#include <doctest/doctest.h>

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <thread>
#include <vector>

using namespace spindle;
using namespace std::chrono_literals;
using store::Entry;
using store::NewEvent;
using store::Stored;

namespace {

/// Long for a machine that others keep busy; no test waits for it to pass.
constexpr auto patience = 60s;

/// A store in memory that fails as it is told.
class FakeWriter final : public store::Writer {
 public:
  Result<store::RowId> tool(const store::ToolName&, const std::string&) override { return 1; }
  Result<bool> has_tool(const store::ToolName&) override { return true; }
  Result<store::RowId> place(const store::Place&) override { return 1; }
  Result<std::optional<store::Last>> last(store::RowId) override { return std::nullopt; }
  Result<void> adopt(store::RowId, const store::Last&) override { return {}; }
  Result<store::Trimmed> trim(WallTime, WallTime) override { return store::Trimmed(); }

  Result<std::vector<Stored>> commit(std::span<const Entry> entries) override {
    std::unique_lock lock(mutex_);
    ++attempts;
    changed_.notify_all();
    changed_.wait(lock, [this] { return is_open_; });
    if (failure_) return tl::unexpected(*failure_);
    for (const Entry& entry : entries) {
      const auto* event = std::get_if<NewEvent>(&entry);
      if (event != nullptr && event->event.number == poison) {
        return tl::unexpected(Error{.code = Errc::internal, .message = "no such place"});
      }
    }
    std::vector<Stored> all;
    for (const Entry& entry : entries) {
      rows_.push_back(entry);
      all.push_back({.id = static_cast<store::RowId>(rows_.size())});
    }
    sizes_.push_back(entries.size());
    changed_.notify_all();
    return all;
  }

  void fail(std::optional<Error> error) {
    const std::lock_guard lock(mutex_);
    failure_ = std::move(error);
  }
  /// A store that is closed keeps who commits waiting.
  void open(bool is_open) {
    const std::lock_guard lock(mutex_);
    is_open_ = is_open;
    changed_.notify_all();
  }
  std::vector<Entry> rows(std::size_t at_least) {
    std::unique_lock lock(mutex_);
    REQUIRE(changed_.wait_for(lock, patience, [&] { return rows_.size() >= at_least; }));
    return rows_;
  }
  void wait_for_attempts(int count) {
    std::unique_lock lock(mutex_);
    REQUIRE(changed_.wait_for(lock, patience, [&] { return attempts >= count; }));
  }
  std::vector<std::size_t> sizes() {
    const std::lock_guard lock(mutex_);
    return sizes_;
  }

  std::uint16_t poison = 0;
  int attempts = 0;

 private:
  std::mutex mutex_ = {};
  std::condition_variable changed_ = {};
  bool is_open_ = true;
  std::optional<Error> failure_ = std::nullopt;
  std::vector<Entry> rows_ = {};
  std::vector<std::size_t> sizes_ = {};
};

/// A journal, and what it tells.
struct Bench {
  explicit Bench(work::JournalOptions options = {.gather = 1ms, .first_retry = 1ms})
      : journal(
            writer, options,
            [this](const Entry& entry, const Stored&) {
              const std::lock_guard lock(mutex);
              own.push_back(entry);
            },
            [this](const std::optional<Error>& error) {
              const std::lock_guard lock(mutex);
              troubles.push_back(error ? error->message : "none");
            }) {}

  void add(std::uint16_t number, std::optional<store::Gap> gap = std::nullopt) {
    journal.add(NewEvent{.event = {.tool = 1, .number = number}, .gap = std::move(gap)},
                [this](const Entry& entry, const Stored& stored) {
                  const std::lock_guard lock(mutex);
                  told.push_back({std::get<NewEvent>(entry).event.number, stored.id});
                  changed.notify_all();
                });
  }
  /// Until then what was stored still takes its room.
  void wait_until_told(std::size_t count) {
    std::unique_lock lock(mutex);
    REQUIRE(changed.wait_for(lock, patience, [&] { return told.size() >= count; }));
  }
  std::vector<std::string> all_troubles() {
    const std::lock_guard lock(mutex);
    return troubles;
  }

  std::mutex mutex = {};
  std::condition_variable changed = {};
  std::vector<std::pair<std::uint16_t, store::RowId>> told = {};
  std::vector<Entry> own = {};
  std::vector<std::string> troubles = {};
  FakeWriter writer = {};
  work::Journal journal;
};

std::vector<std::uint16_t> numbers_of(const std::vector<Entry>& rows) {
  std::vector<std::uint16_t> numbers;
  for (const Entry& row : rows) {
    if (const auto* event = std::get_if<NewEvent>(&row)) numbers.push_back(event->event.number);
  }
  return numbers;
}

Error disk_full() { return {.code = Errc::storage, .message = "the disk is full"}; }

}  // namespace

TEST_CASE("journal: everything is stored in order, and told behind its commit") {
  Bench bench;
  for (std::uint16_t number = 1; number <= 50; ++number) bench.add(number);
  CHECK(bench.journal.close(patience) == 0);
  const auto rows = numbers_of(bench.writer.rows(50));
  REQUIRE(rows.size() == 50);
  REQUIRE(bench.told.size() == 50);
  for (std::uint16_t number = 1; number <= 50; ++number) {
    CHECK(rows[number - 1U] == number);
    CHECK(bench.told[number - 1U] == std::pair<std::uint16_t, store::RowId>(number, number));
  }
}

TEST_CASE("journal: what waits is stored in one transaction, but for so many entries at most") {
  Bench bench({.gather = 1ms, .most = 10});
  bench.writer.open(false);
  bench.add(1);
  bench.writer.wait_for_attempts(1);
  for (std::uint16_t number = 2; number <= 26; ++number) bench.add(number);
  bench.writer.open(true);
  bench.writer.rows(26);
  CHECK(bench.writer.sizes() == std::vector<std::size_t>{1, 10, 10, 5});
}

TEST_CASE("journal: it says of which tool something waits") {
  Bench bench;
  bench.writer.open(false);
  bench.add(1);
  bench.writer.wait_for_attempts(1);
  CHECK(bench.journal.waits_for(1));
  CHECK_FALSE(bench.journal.waits_for(2));
  bench.writer.open(true);
  bench.wait_until_told(1);
  CHECK_FALSE(bench.journal.waits_for(1));
}

TEST_CASE("journal: it gives signs of life while storing works, and while there is nothing to do") {
  std::atomic<int> signs = 0;
  work::JournalOptions options = {.gather = 1ms, .first_retry = 1ms};
  options.alive = [&signs] { ++signs; };
  options.alive_every = 1ms;
  Bench bench(options);
  const auto wait_for_sign = [&] {
    const int before = signs;
    while (signs == before) std::this_thread::yield();
  };
  wait_for_sign();
  bench.add(1);
  bench.wait_until_told(1);
  wait_for_sign();
  SUBCASE("none while it hangs") { bench.writer.open(false); }
  SUBCASE("none while it fails") { bench.writer.fail(disk_full()); }
  bench.add(2);
  bench.writer.wait_for_attempts(2);
  const int before = signs;
  for (int tick = 0; tick < 20; ++tick) {
    std::mutex mutex;
    std::unique_lock lock(mutex);
    std::condition_variable().wait_for(lock, 1ms);
  }
  CHECK(signs == before);
  bench.writer.fail(std::nullopt);
  bench.writer.open(true);
  bench.wait_until_told(2);
  wait_for_sign();
}

TEST_CASE("journal: nothing is told of what is not stored, and nothing is lost while it fails") {
  Bench bench;
  bench.writer.fail(disk_full());
  for (std::uint16_t number = 1; number <= 3; ++number) bench.add(number);
  bench.writer.wait_for_attempts(5);
  {
    const std::lock_guard lock(bench.mutex);
    CHECK(bench.told.empty());
    CHECK(bench.troubles == std::vector<std::string>{"the disk is full"});
  }
  bench.writer.fail(std::nullopt);
  CHECK(bench.journal.close(patience) == 0);
  CHECK(numbers_of(bench.writer.rows(3)) == std::vector<std::uint16_t>{1, 2, 3});
  CHECK(bench.told.size() == 3);
  CHECK(bench.all_troubles() == std::vector<std::string>{"the disk is full", "none"});
}

TEST_CASE("journal: what finds no room is a gap in front of the next event of its tool") {
  Bench bench({.gather = 1ms, .capacity = 2, .first_retry = 1ms, .last_retry = 1ms});
  bench.writer.fail(disk_full());
  for (std::uint16_t number = 1; number <= 5; ++number) bench.add(number);
  bench.writer.fail(std::nullopt);
  bench.wait_until_told(2);
  bench.add(6);
  CHECK(bench.journal.close(patience) == 0);
  const auto rows = bench.writer.rows(3);
  std::uint32_t missed = 0;
  for (const Entry& row : rows) {
    const auto* event = std::get_if<NewEvent>(&row);
    const store::Gap* gap = nullptr;
    if (event != nullptr && event->gap) gap = &*event->gap;
    if (const auto* alone = std::get_if<store::NewGap>(&row)) gap = &alone->gap;
    if (gap == nullptr) continue;
    CHECK(gap->after == 2);
    CHECK(gap->before == 6);
    missed += gap->missed.value_or(0);
  }
  CHECK(missed == 3);
  CHECK(numbers_of(rows) == std::vector<std::uint16_t>{1, 2, 6});
}

TEST_CASE("journal: the gap of what was lost has the gaps that it would have told") {
  Bench bench({.gather = 1ms, .capacity = 1, .first_retry = 1ms, .last_retry = 1ms});
  bench.writer.fail(disk_full());
  bench.add(1);
  bench.add(5, store::Gap{.tool = 1, .after = 1, .before = 5, .missed = 3, .reason = "a jump"});
  bench.writer.fail(std::nullopt);
  CHECK(bench.journal.close(patience) == 0);
  const auto rows = bench.writer.rows(2);
  const auto* gap = std::get_if<store::NewGap>(&rows.back());
  REQUIRE(gap != nullptr);
  CHECK(gap->gap.after == 1);
  CHECK(gap->gap.before == 6);
  CHECK(gap->gap.missed == 4U);
}

TEST_CASE("journal: one entry that no store takes does not keep the others") {
  Bench bench;
  bench.writer.poison = 2;
  for (std::uint16_t number = 1; number <= 4; ++number) bench.add(number);
  CHECK(bench.journal.close(patience) == 0);
  CHECK(numbers_of(bench.writer.rows(3)) == std::vector<std::uint16_t>{1, 3, 4});
  CHECK(bench.all_troubles().back() == "no such place");
}

TEST_CASE("journal: what could not be stored before the end is counted") {
  Bench bench;
  bench.writer.fail(disk_full());
  for (std::uint16_t number = 1; number <= 3; ++number) bench.add(number);
  CHECK(bench.journal.close(10ms) == 3);
  CHECK(bench.told.empty());
}

TEST_CASE("journal: what need not be stored at once goes with what comes next") {
  Bench bench;
  bench.journal.add_lazily(store::Seen{.tool = 1});
  bench.add(1);
  CHECK(bench.journal.close(patience) == 0);
  CHECK(bench.writer.rows(2).size() == 2);
}
