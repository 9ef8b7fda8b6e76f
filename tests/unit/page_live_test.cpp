#include <doctest/doctest.h>

#include "page/live.hpp"
#include "support/fake_clock.hpp"

using namespace spindle;
using namespace spindle::page;
using namespace std::chrono_literals;

namespace {

const ProductWords& no_words(const std::string& /*profile*/) {
  static const ProductWords none = {};
  return none;
}

const store::Place place{
    .id = 1, .tool = 7, .name = "station1", .profile = "x", .since = test::FakeClock::wall_start};

/// What is live, and how rows come into it.
class Bench {
 public:
  explicit Bench(Live::Options options = {}) : live(clock, std::move(options)) {
    Board board({.begin = clock.wall() - 1h, .end = clock.wall() + 7h}, no_words);
    board.note(place, nullptr);
    live.replace(std::move(board), {.event = 10});
    live.situate({}, Recorder::runs);
  }

  void tell(int count = 1) {
    const auto told = live.advance(
        [&](Board& board, Position& position, std::vector<Live::Told>& list) -> Result<void> {
          for (int each = 0; each < count; ++each) {
            ++position.event;
            board.note(store::EventView{.id = position.event,
                                        .tool = 7,
                                        .place = 1,
                                        .at = clock.wall(),
                                        .kind = "fastening-ok"},
                       place);
            list.push_back({position, "{}"});
          }
          return {};
        });
    REQUIRE(told);
  }

  test::FakeClock clock = {};
  Live live;
};

std::size_t occurrences(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

}  // namespace

TEST_CASE("page: a frame is an event with its id and ends with an empty line") {
  CHECK(frame("record", Position{1, 2, 3}, "{}") == "event: record\nid: e1.g2.h3\ndata: {}\n\n");
  CHECK(frame("now", std::nullopt, "1") == "event: now\ndata: 1\n\n");
}

TEST_CASE("page: who joins gets all, and then what is new with its ids") {
  Bench bench;
  auto [view, where] = bench.live.join();
  CHECK(view.find("id: e10.g0.h0\n") != std::string::npos);
  CHECK(view.find("station1") != std::string::npos);
  CHECK(bench.live.wait(where, 0ms).text.empty());
  bench.tell(2);
  const auto batch = bench.live.wait(where, 0ms);
  CHECK(occurrences(batch.text, "event: record\n") == 2);
  CHECK(batch.text.find("id: e11.g0.h0\n") < batch.text.find("id: e12.g0.h0\n"));
  CHECK(occurrences(batch.text, "event: view\n") == 1);
  CHECK(where.position == Position{.event = 12});
  CHECK(bench.live.wait(where, 0ms).text.empty());
}

TEST_CASE("page: what was not changed is not told again") {
  Bench bench;
  auto where = bench.live.join().second;
  bench.live.situate({}, Recorder::runs);
  bench.tell(0);
  CHECK(bench.live.wait(where, 0ms).text.empty());
  bench.live.situate({}, Recorder::stopped);
  CHECK(bench.live.wait(where, 0ms).text.find("Nothing is recorded now") != std::string::npos);
  bench.live.situate("The store is gone.", Recorder::stopped);
  CHECK(bench.live.wait(where, 0ms).text.find("The store is gone.") != std::string::npos);
}

TEST_CASE("page: who is too slow is told to join again, and from where") {
  Bench bench({.most_frames = 4});
  auto where = bench.live.join().second;
  bench.tell();
  bench.live.wait(where, 0ms);
  CHECK(where.position == Position{.event = 11});
  bench.tell(20);
  const auto batch = bench.live.wait(where, 0ms);
  CHECK(batch.is_late);
  CHECK(batch.text.empty());
  CHECK(where.position == Position{.event = 11});
}

TEST_CASE("page: a state that is read anew is no hole: all join again") {
  Bench bench;
  auto where = bench.live.join().second;
  bench.live.replace(Board({}, no_words), {.event = 15});
  CHECK(bench.live.wait(where, 0ms).is_late);
  CHECK(where.position == Position{.event = 10});
}

TEST_CASE("page: a link that is heard no more is told without any row") {
  Bench bench;
  auto where = bench.live.join().second;
  CHECK(bench.live.page().find("Connected") != std::string::npos);
  bench.clock.advance(1min);
  bench.live.situate({}, Recorder::runs);
  CHECK(bench.live.wait(where, 0ms).text.find("Not known") != std::string::npos);
  CHECK(bench.live.page().find("Connected") == std::string::npos);
}

TEST_CASE("page: a tool that was not heard for a week is named, and has no card") {
  Bench bench;
  bench.clock.advance(std::chrono::hours(24 * 8));
  bench.live.situate({}, Recorder::runs);
  const std::string page = bench.live.page();
  CHECK(page.find("<article") == std::string::npos);
  CHECK(page.find("left out: station1") != std::string::npos);
}

TEST_CASE("page: at the end nothing waits") {
  Bench bench;
  auto where = bench.live.join().second;
  bench.live.close();
  CHECK(bench.live.wait(where, 24h).is_over);
}
