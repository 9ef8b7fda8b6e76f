#include "spindle/commands/service_news.hpp"

#include <doctest/doctest.h>

#include <string>
#include <vector>

#include "support/fake_clock.hpp"

using namespace spindle;
using namespace std::chrono_literals;
using commands::ServiceNews;

namespace {

struct Bench {
  explicit Bench(std::optional<Duration> watchdog = 30s)
      : news({.notify = [this](std::string_view state) { told.emplace_back(state); },
              .watchdog = watchdog},
             clock) {}

  std::vector<std::string> take() { return std::exchange(told, {}); }

  test::FakeClock clock = test::FakeClock();
  std::vector<std::string> told = {};
  ServiceNews news;
};

using Told = std::vector<std::string>;

}  // namespace

TEST_CASE("service news: ready once, and a reload in between") {
  Bench bench;
  bench.news.reloading();
  bench.news.reloaded();
  CHECK(bench.take().empty());
  bench.news.ready();
  bench.news.ready();
  CHECK(bench.take() == Told{"READY=1"});
  bench.news.reloading();
  bench.news.reloaded();
  CHECK(bench.take() == Told{"RELOADING=1\nMONOTONIC_USEC=3600000000", "READY=1"});
  bench.news.stopping();
  CHECK(bench.take() == Told{"STOPPING=1"});
}

TEST_CASE("service news: a status is told when it is another one, once a second") {
  Bench bench;
  bench.news.status("one");
  bench.news.status("two");
  CHECK(bench.take() == Told{"STATUS=one"});
  bench.clock.advance(1s);
  bench.news.status("one");
  CHECK(bench.take().empty());
  bench.news.status("two");
  CHECK(bench.take() == Told{"STATUS=two"});
}

TEST_CASE("service news: a sign of life often enough, however often it is given") {
  Bench bench;
  REQUIRE(bench.news.period() == Duration(7500ms));
  int signs = 0;
  for (int second = 0; second < 300; ++second) {
    bench.news.alive();
    bench.clock.advance(1s);
    signs += static_cast<int>(bench.take().size());
  }
  CHECK(signs >= 300 / 15);
  CHECK(signs <= 300 / 3);
}

TEST_CASE("service news: trouble asks for patience, and its end for what was before") {
  Bench bench;
  bench.news.trouble(true);
  bench.news.trouble(false);
  CHECK(bench.take() == Told{"WATCHDOG_USEC=3600000000", "WATCHDOG_USEC=30000000"});
}

TEST_CASE("service news: a manager that does not watch is told of no life") {
  Bench bench(std::nullopt);
  CHECK_FALSE(bench.news.period());
  bench.news.alive();
  bench.news.trouble(true);
  CHECK(bench.take().empty());
}

TEST_CASE("service news: without a manager nothing happens") {
  const test::FakeClock clock;
  ServiceNews news({}, clock);
  news.ready();
  news.status("fine");
  news.alive();
  news.stopping();
}
