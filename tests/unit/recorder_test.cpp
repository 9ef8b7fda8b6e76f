#include "commands/recorder.hpp"

#include <doctest/doctest.h>

#include <string>
#include <vector>

#include "commands/recording.hpp"
#include "support/fake_clock.hpp"
#include "support/memory_disk.hpp"
#include "support/rig.hpp"
#include "support/temporary_folder.hpp"

using namespace spindle;
using namespace std::chrono_literals;
using commands::RecordedTool;
using commands::Task;
using device::LinkChange;
using device::LinkState;

namespace {

/// A recorder of a real store, whose tools say what the test makes them say.
struct Bench {
  Bench() : writer(store::Writer::open(folder.path() + "/events.db").value()) {}

  RecordedTool& tool(const std::string& name, Task& task) {
    RecordedTool& recorded = recorder.recorded(
        {.shown = name, .endpoint = link::parse_endpoint("tcp://" + name).value()});
    recorded.begin(task);
    return recorded;
  }
  /// What people were told meanwhile.
  std::vector<std::string> take_notes() {
    std::vector<std::string> notes;
    for (const auto& section : renderer.sections()) {
      for (const auto& entry : section.entries) {
        if (const auto* note = std::get_if<std::string>(&entry)) notes.push_back(*note);
      }
    }
    std::vector<std::string> fresh(notes.begin() + static_cast<std::ptrdiff_t>(seen), notes.end());
    seen = notes.size();
    return fresh;
  }

  test::TemporaryFolder folder = {};
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
  std::unique_ptr<store::Writer> writer;
  commands::WatchOptions options = {};
  commands::WatchStream stream =
      commands::WatchStream(options, 1, {}, context, commands::Records::counted);
  commands::ServiceNews news = commands::ServiceNews({}, clock);
  commands::Recorder recorder = commands::Recorder(*writer, stream, news, {}, context);
  std::size_t seen = 0;
};

using Notes = std::vector<std::string>;

}  // namespace

TEST_CASE("recorder: a link is told when it changes, once a minute at most, and in the end") {
  Bench bench;
  Task task;
  RecordedTool& tool = bench.tool("station1", task);
  tool.tell(LinkChange{LinkState::connected, 0, "connected: 1"});
  CHECK(bench.take_notes() == Notes{"station1: connected: 1"});
  for (int times = 0; times < 5; ++times) {
    bench.clock.advance(1s);
    tool.tell(LinkChange{LinkState::lost, 0, "closed"});
    tool.tell(LinkChange{LinkState::connected, 0, "connected: 1"});
  }
  tool.tell(LinkChange{LinkState::lost, 0, "closed"});
  CHECK(bench.take_notes().empty());
  // It stays lost, and nothing new comes but attempts in vain.
  for (unsigned attempt = 1; attempt < 30; ++attempt) {
    bench.clock.advance(10s);
    tool.tell(LinkChange{LinkState::reconnecting, attempt, "no route"});
  }
  CHECK(bench.take_notes() == Notes{"station1: no link: closed"});
}

TEST_CASE("recorder: five hundred links that flap are five hundred lines a minute at most") {
  Bench bench;
  Task task;
  std::vector<RecordedTool*> tools;
  for (int number = 0; number < 500; ++number) {
    tools.push_back(&bench.tool("station" + std::to_string(number), task));
  }
  std::size_t lines = 0;
  for (int second = 0; second < 180; ++second) {
    for (RecordedTool* tool : tools) {
      tool->tell(LinkChange{second % 2 == 0 ? LinkState::connected : LinkState::lost, 0, "x"});
    }
    bench.clock.advance(1s);
  }
  lines = bench.take_notes().size();
  CHECK(lines == 3 * 500);
}

TEST_CASE("recorder: a tool is tried when something is known of its link") {
  Bench bench;
  Task task;
  RecordedTool& tool = bench.tool("station1", task);
  CHECK(bench.recorder.counters().connected() == 0);
  CHECK(bench.recorder.counters().metrics().links.count("station1") == 1);
  tool.tell(LinkChange{LinkState::connecting, 1, "refused"});
  CHECK(bench.recorder.counters().connected() == 0);
  tool.tell(LinkChange{LinkState::connected, 1, "connected"});
  CHECK(bench.recorder.counters().connected() == 1);
  tool.left({}, std::nullopt);
  CHECK(bench.recorder.counters().connected() == 0);
}

TEST_CASE("recorder: one that comes again is the one of before, and another entry another one") {
  Bench bench;
  const work::Target target = {.shown = "a", .endpoint = link::parse_endpoint("tcp://a").value()};
  work::Target other = target;
  other.torque_unit = "N.m";
  RecordedTool* const first = &bench.recorder.recorded(target);
  CHECK(&bench.recorder.recorded(other) != first);
  CHECK(&bench.recorder.recorded(target) == first);
}
