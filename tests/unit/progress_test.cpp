#include "spindle/report/progress.hpp"

#include <doctest/doctest.h>

#include <string>
#include <thread>
#include <vector>

#include "support/fake_clock.hpp"

using namespace spindle;
using namespace spindle::report;
using namespace std::chrono_literals;

namespace {

const std::string wipe = "\r\x1b[K";

/// A terminal that remembers what was written to it, one entry a call.
struct Terminal {
  std::vector<std::string> writes;
  bool is_ready = true;
  std::size_t columns = 80;
  Streams streams{.out = [this](std::string_view text) -> Result<void> {
                    writes.push_back("out:" + std::string(text));
                    return {};
                  },
                  .err = [this](std::string_view text) { writes.emplace_back(text); },
                  .read_line = [] { return std::nullopt; },
                  .out_is_terminal = true,
                  .err_is_terminal = true,
                  .err_is_ready = [this] { return is_ready; },
                  .err_columns = [this] { return columns; }};

  Terminal() = default;
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;

  /// What stands in the line after the last write.
  [[nodiscard]] std::string line() const {
    return writes.empty() ? std::string() : writes.back().substr(wipe.size());
  }
};

Step reading(std::size_t done, std::size_t total = 725) {
  return {.what = "station3: reading", .done = done, .total = total};
}

/// The line after steps of the same length, one second each but for the first.
std::string line_after(std::size_t done_each, std::size_t steps, std::size_t total,
                       Duration each = 1s) {
  Terminal terminal;
  test::FakeClock clock;
  Progress progress(terminal.streams, clock, Showing::wanted);
  progress.advance(reading(0, total));
  for (std::size_t step = 1; step <= steps; ++step) {
    clock.advance(each);
    progress.advance(reading(step * done_each, total));
  }
  return terminal.line();
}

}  // namespace

TEST_CASE("counted work: how far, how fast, how long still") {
  CHECK(line_after(0, 0, 725) == "station3: reading 0 of 725");
  CHECK(line_after(156, 2, 725) == "station3: reading 312 of 725, 156/s, 3 s left");
  CHECK(line_after(725, 1, 725) == "station3: reading 725 of 725");
  CHECK(line_after(5, 2, 40) == "station3: reading 10 of 40, 5.0/s, 6 s left");
  CHECK(line_after(1, 3, 31, 2s) == "station3: reading 3 of 31, 30/min, 56 s left");
  CHECK(line_after(1, 2, 31, 10s) == "station3: reading 2 of 31, 6/min, 5 min left");
  CHECK(line_after(1, 2, 500, 90s) == "station3: reading 2 of 500, 13 h left");
}

TEST_CASE("nothing is guessed: not in the first moments, not from one step, never 0 s left") {
  CHECK(line_after(100, 2, 725, 400ms) == "station3: reading 200 of 725");
  CHECK(line_after(1, 1, 31, 5s) == "station3: reading 1 of 31");
  CHECK(line_after(724, 1, 725, 2s) == "station3: reading 724 of 725, 362/s, 1 s left");

  // Forty tools that go on side by side also end together.
  Terminal terminal;
  test::FakeClock clock;
  Progress progress(terminal.streams, clock, Showing::wanted);
  for (const std::size_t done : {0U, 5U, 15U, 16U}) {
    progress.advance({.what = "tools done:", .done = done, .total = 40, .at_once = 8});
    const bool has_pace = terminal.line().find("left") != std::string::npos;
    CHECK(has_pace == (done == 16));
    clock.advance(2s);
  }
}

TEST_CASE("what was done before the first step counts for nothing") {
  Terminal terminal;
  test::FakeClock clock;
  Progress progress(terminal.streams, clock, Showing::wanted);
  progress.advance(reading(100, 400));
  clock.advance(2s);
  progress.advance(reading(200, 400));
  CHECK(terminal.line() == "station3: reading 200 of 400, 50/s, 4 s left");

  // The same work anew, and another piece of work: both begin at once, with a pace of their own.
  progress.advance(reading(1, 400));
  CHECK(terminal.line() == "station3: reading 1 of 400");
  progress.advance({.what = "station3: writing", .done = 0, .total = 9, .more = "1 refused"});
  CHECK(terminal.line() == "station3: writing 0 of 9, 1 refused");
}

TEST_CASE("it is drawn ten times a second at most, and the end is always drawn") {
  Terminal terminal;
  test::FakeClock clock;
  Progress progress(terminal.streams, clock, Showing::wanted);
  for (std::size_t done = 0; done <= 1000; ++done) {
    progress.advance(reading(done, 1000));
    clock.advance(1ms);
  }
  CHECK(terminal.writes.size() == 11);
  CHECK(terminal.line().starts_with("station3: reading 1000 of 1000"));

  terminal.writes.clear();
  for (int tenth = 0; tenth < 1000; ++tenth) {
    progress.refresh("running " + std::to_string(tenth));
    clock.advance(1ms);
  }
  CHECK(terminal.writes.size() == 10);
  progress.show("the link is lost");
  progress.show("the link is found");
  CHECK(terminal.line() == "the link is found");
}

TEST_CASE("whatever else is written takes the line away first, and so does the end") {
  Terminal terminal;
  test::FakeClock clock;
  {
    Progress progress(terminal.streams, clock, Showing::wanted);
    terminal.streams.err("before\n");
    CHECK(terminal.writes == std::vector<std::string>{"before\n"});
    progress.show("working");
    terminal.streams.err("an error\n");
    progress.show("working");
    REQUIRE(terminal.streams.out("a record\n"));
    REQUIRE(terminal.streams.out("another\n"));
    progress.show("working");
    progress.clear();
    progress.clear();
    progress.show("still working");
  }
  terminal.streams.err("after\n");
  REQUIRE(terminal.streams.out("after\n"));
  CHECK(terminal.writes ==
        std::vector<std::string>{"before\n", wipe + "working", wipe, "an error\n", wipe + "working",
                                 wipe, "out:a record\n", "out:another\n", wipe + "working", wipe,
                                 wipe + "still working", wipe, "after\n", "out:after\n"});
}

TEST_CASE("output that goes elsewhere leaves the line alone") {
  Terminal terminal;
  terminal.streams.out_is_terminal = false;
  test::FakeClock clock;
  Progress progress(terminal.streams, clock, Showing::wanted);
  progress.show("working");
  REQUIRE(terminal.streams.out("a record\n"));
  CHECK(terminal.writes == std::vector<std::string>{wipe + "working", "out:a record\n"});
}

TEST_CASE("it says nothing where there is no terminal, where it is not wanted, and never waits") {
  test::FakeClock clock;
  Terminal elsewhere;
  elsewhere.streams.err_is_terminal = false;
  Terminal unwanted;
  Terminal halted;
  halted.is_ready = false;
  for (Terminal* terminal : {&elsewhere, &unwanted, &halted}) {
    const auto showing = terminal == &unwanted ? Showing::unwanted : Showing::wanted;
    {
      Progress progress(terminal->streams, clock, showing);
      progress.advance(reading(1));
      progress.show("working");
      progress.refresh("working");
      progress.clear();
    }
    CHECK(terminal->writes.empty());
  }
}

TEST_CASE("it is never wider than the terminal, and the counts stay") {
  Terminal terminal;
  test::FakeClock clock;
  Progress progress(terminal.streams, clock, Showing::wanted);
  const auto shown = [&](std::size_t columns, const std::string& what) {
    progress.clear();
    terminal.columns = columns;
    progress.advance({.what = what, .done = 0, .total = 725});
    return terminal.line();
  };
  CHECK(shown(36, "tcp://192.168.100.123:5000: reading") == "...8.100.123:5000: reading 0 of 725");
  CHECK(shown(20, "station3: reading") == "...reading 0 of 725");
  CHECK(shown(8, "x") == " 0 o...");
  CHECK(shown(3, "y") == "..");
  CHECK(shown(2, "z") == ".");
  CHECK(shown(0, std::string(100, 'w')).size() == 79);
  CHECK(shown(26, "トルクトルクトルク") == "...トルクトルク 0 of 725");
  CHECK(shown(80, "two\nlines \x1b[2J") == "two lines \\x1b[2J 0 of 725");
  progress.clear();
  terminal.columns = 10;
  progress.show("トルクトルク");
  CHECK(terminal.line() == "トルク...");
}

TEST_CASE("several lines: all of them go before something else is written") {
  Terminal terminal;
  test::FakeClock clock;
  Progress progress(terminal.streams, clock, Showing::wanted);
  const std::vector<ScreenLine> lines = {{"station3  connected", 19}, {"station4  lost", 14}};
  progress.show(lines);
  CHECK(terminal.writes.back() == wipe + "station3  connected\nstation4  lost");
  progress.show(lines);
  CHECK(terminal.writes.back() == "\r\x1b[1A\x1b[Jstation3  connected\nstation4  lost");
  REQUIRE(terminal.streams.out("an event\n"));
  REQUIRE(terminal.writes.size() == 4);
  CHECK(terminal.writes[2] == "\r\x1b[1A\x1b[J");
  CHECK(terminal.writes[3] == "out:an event\n");
  terminal.streams.err("a note\n");
  CHECK(terminal.writes.size() == 5);  // nothing is left that would have to go
}

TEST_CASE("a terminal that became narrower has put lines into further rows") {
  Terminal terminal;
  test::FakeClock clock;
  Progress progress(terminal.streams, clock, Showing::wanted);
  const std::vector<ScreenLine> lines = {{std::string(70, 'a'), 70}, {std::string(20, 'b'), 20}};
  progress.show(lines);
  terminal.columns = 30;
  progress.clear();
  CHECK(terminal.writes.back() == "\r\x1b[3A\x1b[J");
}

TEST_CASE("how much of a terminal there is, also where it does not say") {
  Terminal terminal;
  test::FakeClock clock;
  std::size_t rows = 50;
  terminal.streams.err_rows = [&rows] { return rows; };
  const Progress progress(terminal.streams, clock, Showing::wanted);
  CHECK(progress.screen() == Screen{77, 50});
  terminal.columns = 3;
  rows = 0;
  CHECK(progress.screen() == Screen{2, 24});
  CHECK(progress.is_shown());
}

TEST_CASE("several threads may tell how far they are while others write") {
  Terminal terminal;
  test::FakeClock clock;
  {
    Progress progress(terminal.streams, clock, Showing::wanted);
    std::vector<std::jthread> threads;
    for (int thread = 0; thread < 4; ++thread) {
      threads.emplace_back([&] {
        for (std::size_t done = 0; done < 200; ++done) {
          progress.advance(reading(done));
          terminal.streams.err("note\n");
        }
      });
    }
  }
  // A note never stands behind the line.
  for (std::size_t at = 1; at < terminal.writes.size(); ++at) {
    const bool is_note = terminal.writes[at] == "note\n";
    const bool behind_line =
        terminal.writes[at - 1].size() > wipe.size() && terminal.writes[at - 1].starts_with(wipe);
    CHECK_FALSE((is_note && behind_line));
  }
}
