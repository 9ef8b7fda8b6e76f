#include "commands/roster.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include "commands/recording.hpp"
#include "support/fake_clock.hpp"
#include "support/memory_disk.hpp"
#include "support/rig.hpp"

using namespace spindle;
using namespace std::chrono_literals;
using commands::Roster;
using commands::Task;
using commands::WatchedTool;

namespace {

/// Long for a machine that others keep busy; no test waits for it to pass.
constexpr auto patience = 60s;

/// What a tool that is not connected needs.
struct Stage {
  Interrupt interrupt = Interrupt();
  test::FakeClock clock = test::FakeClock();
  device::OpenTransport open = {};
  work::Uninterruptible uninterruptible = {clock, interrupt, open};
  Disk disk = test::MemoryDisk().functions();
  std::string state = {};
  files::Tools tools = {};
  work::ShowFrames show_frames = {};
  report::Streams io = {};
  sim::Serve serve = {};
  std::function<void()> end_waits = [] {};
  commands::Companions companions = {};
  commands::RecordingRenderer renderer = {};
  files::ProfileStore profiles = files::ProfileStore({}, posix::source_disk());
  commands::ProfileShelf shelf = commands::ProfileShelf(profiles);
  std::vector<std::string> names = {};
  commands::Context context = {
      {.clock = clock,
       .interrupt = interrupt,
       .open = open,
       .uninterruptible = uninterruptible,
       .disk = disk,
       .state_folder = state,
       .version = "1",
       .profiles = profiles,
       .tools = tools,
       .show_frames = show_frames},
      {.io = io, .serve = serve, .end_waits = end_waits, .companions = companions},
      {.renderer = renderer}};
};

/// Watches that go on until they are asked to leave, or end by themselves when the test says so.
class Bench {
 public:
  /// "name=url", each.
  Roster::Change want(const std::vector<std::string>& entries) {
    std::vector<WatchedTool> tools;
    for (const std::string& entry : entries) {
      const auto equals = entry.find('=');
      work::Target target = {.shown = entry.substr(0, equals),
                             .endpoint = link::parse_endpoint(entry.substr(equals + 1)).value()};
      tools.push_back(
          WatchedTool::make(std::move(target), stage_.names, stage_.shelf, stage_.context).value());
    }
    return roster.want(std::move(tools));
  }
  /// What happened to the watches, in order, once there is so much of it.
  std::vector<std::string> log(std::size_t at_least) {
    std::unique_lock lock(mutex_);
    REQUIRE(changed_.wait_for(lock, patience, [&] { return log_.size() >= at_least; }));
    return log_;
  }
  /// The watch of this tool does not end although it is asked to.
  void hold(const std::string& name, bool is_held) {
    const std::lock_guard lock(mutex_);
    held_[name] = is_held;
    changed_.notify_all();
  }
  void end(const std::string& name) {
    const std::lock_guard lock(mutex_);
    ended_[name] = true;
    changed_.notify_all();
  }
  bool is_watched(const std::string& name) {
    const std::lock_guard lock(mutex_);
    return watched_[name] > 0;
  }

 private:
  void watch(WatchedTool& tool, Task& task) {
    const std::string name = tool.target().shown;
    std::unique_lock lock(mutex_);
    log_.push_back("+" + name + " " + tool.target().endpoint.text);
    ++watched_[name];
    task.note_tried();
    changed_.notify_all();
    const auto is_over = [&] {
      return (task.is_leaving() && !held_[name]) || std::exchange(ended_[name], false);
    };
    while (!changed_.wait_for(lock, 1ms, is_over)) {
    }
    log_.push_back("-" + name);
    --watched_[name];
    changed_.notify_all();
  }

  Stage stage_ = {};
  std::mutex mutex_ = {};
  std::condition_variable changed_ = {};
  std::vector<std::string> log_ = {};
  std::map<std::string, bool> held_ = {};
  std::map<std::string, bool> ended_ = {};
  std::map<std::string, int> watched_ = {};

 public:
  Roster roster = Roster([this](auto& tool, auto& task) { watch(tool, task); });
};

using Log = std::vector<std::string>;

Log sorted(Log log) {
  std::sort(log.begin(), log.end());
  return log;
}

Log behind(const Log& log, std::size_t first) {
  return {log.begin() + static_cast<std::ptrdiff_t>(first), log.end()};
}

}  // namespace

TEST_CASE("roster: what is wanted is watched, and what stays is not touched") {
  Bench bench;
  const auto first = bench.want({"a=tcp://a", "b=tcp://b", "c=tcp://c"});
  CHECK(first.begun == 3);
  CHECK(sorted(bench.log(3)) == Log{"+a tcp://a", "+b tcp://b", "+c tcp://c"});
  const auto second = bench.want({"a=tcp://a", "c=tcp://c:503", "d=tcp://d"});
  CHECK(second.begun == 1);
  CHECK(second.left == 1);
  CHECK(second.changed == 1);
  CHECK(second.kept == 1);
  const Log log = behind(bench.log(7), 3);
  CHECK(sorted(log) == Log{"+c tcp://c:503", "+d tcp://d", "-b", "-c"});
  CHECK(std::find(log.begin(), log.end(), "-c") <
        std::find(log.begin(), log.end(), "+c tcp://c:503"));
  const auto standing = bench.roster.standing();
  CHECK(standing.wanted == 3);
  CHECK(standing.watched == 3);
  CHECK(standing.paused == 0);
}

TEST_CASE("roster: the same again changes nothing") {
  Bench bench;
  bench.want({"a=tcp://a", "b=tcp://b"});
  bench.log(2);
  const auto again = bench.want({"b=tcp://b", "a=tcp://a"});
  CHECK(again.kept == 2);
  CHECK(again.begun + again.left + again.changed == 0);
  CHECK(bench.log(2).size() == 2);
}

TEST_CASE("roster: what another collector holds is paused until it may be watched") {
  Bench bench;
  bench.roster.allow(std::set<std::string>());
  bench.want({"a=tcp://a", "b=tcp://b"});
  CHECK(bench.roster.standing().paused == 2);
  CHECK(bench.roster.standing().watched == 0);
  CHECK(bench.roster.is_idle());
  bench.roster.allow(std::set<std::string>{"b", "elsewhere"});
  CHECK(bench.log(1) == Log{"+b tcp://b"});
  bench.roster.allow(std::set<std::string>{"a"});
  CHECK(sorted(behind(bench.log(3), 1)) == Log{"+a tcp://a", "-b"});
  // What is added may not be watched before that is said.
  bench.want({"a=tcp://a", "b=tcp://b", "c=tcp://c"});
  CHECK(bench.roster.standing().paused == 2);
  bench.roster.allow(std::nullopt);
  CHECK(sorted(behind(bench.log(5), 3)) == Log{"+b tcp://b", "+c tcp://c"});
  CHECK(bench.roster.standing().paused == 0);
}

TEST_CASE("roster: a tool waits until those have left that may be the same, or share its line") {
  struct Row {
    const char* what;
    const char* before;
    const char* behind;
    bool waits;
  };
  const Row rows[] = {
      {"the same name", "a=tcp://a", "a=tcp://b", true},
      {"the same address by another name", "a=tcp://a?unit=1", "b=tcp://a?unit=2", true},
      {"the same serial line", "a=rtu:///dev/x?unit=1&baud=9600", "b=rtu:///dev/x?unit=2", true},
      {"another port of the same host", "a=tcp://a:502", "b=tcp://a:503", false},
      {"nothing in common", "a=tcp://a", "b=tcp://b", false},
  };
  for (const Row& row : rows) {
    CAPTURE(row.what);
    Bench bench;
    bench.hold("a", true);
    bench.want({row.before});
    bench.log(1);
    bench.want({row.behind, "other=tcp://other"});
    const std::string name = std::string(row.behind).substr(0, 1);
    bench.log(row.waits ? 2 : 3);  // the other one waits for none
    CHECK(bench.is_watched("other"));
    CHECK(bench.roster.standing().watched == 2);
    CHECK(bench.roster.standing().untried == (row.waits ? 1 : 0));
    bench.hold("a", false);
    bench.log(4);
    CHECK(bench.is_watched(name));
  }
}

TEST_CASE("roster: one that has to wait and is wanted no more is never watched") {
  Bench bench;
  bench.hold("a", true);
  bench.want({"a=tcp://a"});
  bench.log(1);
  bench.want({"a=tcp://b"});
  bench.want({});
  bench.hold("a", false);
  bench.roster.join();
  CHECK(bench.log(2) == Log{"+a tcp://a", "-a"});
  CHECK(bench.roster.is_idle());
}

TEST_CASE("roster: a watch that ended by itself begins when its tool is wanted anew") {
  Bench bench;
  bench.want({"a=tcp://a", "b=tcp://b"});
  bench.log(2);
  bench.end("a");
  bench.log(3);
  while (bench.roster.standing().watched > 1) {
  }
  CHECK_FALSE(bench.roster.is_idle());
  bench.roster.allow(std::nullopt);
  CHECK(bench.roster.standing().watched == 1);
  bench.want({"a=tcp://a", "b=tcp://b"});
  CHECK(bench.log(4).back() == "+a tcp://a");
  CHECK(bench.roster.standing().watched == 2);
}

TEST_CASE("roster: its end leaves all and waits for them") {
  Bench bench;
  {
    bench.want({"a=tcp://a", "b=tcp://b"});
    bench.log(2);
    bench.want({});
    bench.roster.join();
  }
  CHECK_FALSE(bench.is_watched("a"));
  CHECK_FALSE(bench.is_watched("b"));
  CHECK(bench.roster.is_idle());
  CHECK(bench.roster.standing().wanted == 0);
}
