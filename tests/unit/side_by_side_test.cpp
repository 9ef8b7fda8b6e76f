#include "spindle/work/side_by_side.hpp"

#include <doctest/doctest.h>

#include <atomic>
#include <filesystem>
#include <mutex>
#include <string>

using namespace spindle;
using namespace spindle::work;

namespace {

Target target_at(const std::string& url) {
  return {.shown = url, .endpoint = link::parse_endpoint(url).value()};
}

std::vector<Target> targets_at(const std::vector<std::string>& urls) {
  std::vector<Target> targets;
  for (const std::string& url : urls) targets.push_back(target_at(url));
  return targets;
}

using Lines = std::vector<std::vector<std::size_t>>;

}  // namespace

TEST_CASE("the units of one serial line take turns, every other tool has a line of its own") {
  CHECK(by_line({}).empty());
  CHECK(by_line(targets_at({"tcp://a", "tcp://a", "sim:doga-bm", "sim:doga-bm"})) ==
        Lines{{0}, {1}, {2}, {3}});
  CHECK(by_line(targets_at({"rtu:///dev/x?unit=1", "tcp://a", "rtu:///dev/x?unit=2",
                            "rtu:///dev/y?unit=1", "rtu:/dev/x?unit=3"})) ==
        Lines{{0, 2, 4}, {1}, {3}});
  CHECK(by_line(targets_at({"rtu+tcp://g:1?unit=1", "rtu+tcp://g:2?unit=1",
                            "rtu+tcp://g:1?unit=2"})) == Lines{{0, 2}, {1}});
}

TEST_CASE("a port behind a link is the same port") {
  const std::string link =
      std::filesystem::temp_directory_path() / ("spindle-line-" + std::to_string(::getpid()));
  std::filesystem::create_symlink("/dev/null", link);
  CHECK(shared_line(target_at("rtu://" + link).endpoint) == "/dev/null");
  CHECK(by_line(targets_at({"rtu://" + link, "rtu:///dev/null"})) == Lines{{0, 1}});
  std::filesystem::remove(link);
}

TEST_CASE("results come in the order of the targets, whatever shares a line") {
  const auto targets =
      targets_at({"rtu:///dev/x?unit=1", "tcp://a", "rtu:///dev/x?unit=2", "tcp://b"});
  std::mutex mutex;
  std::vector<std::string> order;
  const auto shown = side_by_side(targets, 64, [&](const Target& target) {
    const std::lock_guard lock(mutex);
    order.push_back(target.shown);
    return target.shown;
  });
  REQUIRE(shown.size() == 4);
  for (std::size_t index = 0; index < targets.size(); ++index)
    CHECK(shown[index] == targets[index].shown);
  const auto first = std::find(order.begin(), order.end(), targets[0].shown);
  CHECK(std::find(first, order.end(), targets[2].shown) != order.end());
}

TEST_CASE("no more tools than jobs are handled at the same time, and all of them in the end") {
  std::vector<std::string> urls;
  for (int tool = 0; tool < 20; ++tool) urls.push_back("tcp://host" + std::to_string(tool));
  std::vector<Target> targets;
  for (const std::string& url : urls) targets.push_back(target_at(url));
  for (const int jobs : {1, 3, 64}) {
    std::atomic<int> now = 0;
    std::atomic<int> most = 0;
    const auto shown =
        side_by_side(targets, static_cast<std::size_t>(jobs), [&](const Target& target) {
          const int others = ++now;
          int seen = most.load();
          while (others > seen && !most.compare_exchange_weak(seen, others)) {
          }
          std::this_thread::yield();
          --now;
          return target.shown;
        });
    CHECK(shown == urls);
    CHECK(most.load() >= 1);
    CHECK(most.load() <= jobs);
  }
}
