// What is read of a store: the same records as were told, each once, files for quality departments.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <vector>

#include "commands/odometer.hpp"
#include "commands/recording.hpp"
#include "commands/result_stream.hpp"
#include "commands/stored_records.hpp"
#include "spindle/commands/commands.hpp"
#include "spindle/files/qdas_file.hpp"
#include "support/fake_clock.hpp"
#include "support/memory_disk.hpp"
#include "support/rig.hpp"
#include "support/sample_store.hpp"
#include "support/temporary_folder.hpp"

using namespace spindle;
using namespace std::chrono_literals;

namespace {

const files::ProfileStore& profiles() {
  static const files::ProfileStore store({SPINDLE_SOURCE_DIR "/profiles"}, posix::source_disk());
  return store;
}

/// A command's surroundings, with what it says kept.
struct Stage {
  explicit Stage(report::Format format = report::Format::json)
      : clock(interrupt),
        io{.out = [](std::string_view) { return Result<void>(); },
           .err = [this](std::string_view text) { said += text; },
           .read_line = [] { return std::nullopt; }},
        context{{.clock = clock,
                 .interrupt = interrupt,
                 .open = open,
                 .uninterruptible = uninterruptible,
                 .disk = disk_functions,
                 .state_folder = state,
                 .version = "1",
                 .profiles = profiles(),
                 .tools = tools,
                 .show_frames = show_frames},
                {.io = io,
                 .serve = serve,
                 .end_waits = end_waits,
                 .companions = companions,
                 .user = {.format = format}},
                {.renderer = renderer}} {}

  /// The JSON of the records that were told, but for the summary.
  [[nodiscard]] std::vector<std::string> told() const {
    std::vector<std::string> lines;
    for (const auto& section : renderer.sections()) {
      for (const auto& entry : section.entries) {
        const auto* record = std::get_if<report::Record>(&entry);
        if (record != nullptr) lines.push_back(report::to_json(*record));
      }
    }
    return lines;
  }

  Interrupt interrupt = Interrupt();
  test::FakeClock clock;
  device::OpenTransport open = {};
  work::Uninterruptible uninterruptible = {clock, interrupt, open};
  test::MemoryDisk disk = {};
  Disk disk_functions = disk.functions();
  std::string state = {};
  files::Tools tools = {};
  work::ShowFrames show_frames = {};
  std::string said = {};
  report::Streams io;
  sim::Serve serve = {};
  std::function<void()> end_waits = [] {};
  commands::Companions companions = {};
  commands::RecordingRenderer renderer = {};
  commands::Context context;
};

std::vector<std::string> all_of(const std::string& path, const commands::ResultsOptions& wanted) {
  Stage stage;
  commands::ResultsOptions options = wanted;
  options.store = path;
  const auto outcome = commands::results(options, stage.context);
  REQUIRE_MESSAGE(outcome.has_value(), describe(outcome.error()));
  return stage.told();
}

std::int64_t id_of(const std::string& json) {
  const std::size_t at = json.find("\"id\":");
  return at == std::string::npos ? 0 : std::stol(json.substr(at + 5));
}

std::vector<std::int64_t> events_of(const std::vector<std::string>& lines) {
  std::vector<std::int64_t> ids;
  for (const std::string& line : lines) {
    if (line.find("\"type\":\"event\"") != std::string::npos) ids.push_back(id_of(line));
  }
  return ids;
}

}  // namespace

TEST_CASE("results: an event is the record that it was when it was told, byte for byte") {
  const test::TemporaryFolder folder;
  const std::string path = folder.path() + "/events.db";
  const auto profile = profiles().load("doga-bm").value();
  const auto tables = profiles().load_code_tables("doga-bm").value();
  Registers block(profile.events->count);
  for (std::size_t at = 0; at < block.size(); ++at) {
    block[at] = static_cast<std::uint16_t>(60'000 + at);
  }
  const catalogue::EventLayout layout(profile);
  for (const auto& field : layout.fields()) {
    if (field.key == "status") block[field.at] = 2;
    if (field.key == "error") block[field.at] = 335;
  }
  test::StoreMaker maker(path, profiles());
  maker.connect("station1", "1021100042", "doga-bm");
  const device::ToolEvent news{.source = device::EventOrigin::push,
                               .block = block,
                               .time = maker.now(),
                               .number = layout.number_of(block)};
  store::Event row = work::EventRows(profile).row(news);
  maker.tell_row(std::move(row));
  work::Target target;
  target.shown = "station1";
  target.torque_unit = "N.m";
  const commands::NewsRecords records(target, profile, tables);
  const auto told = records.event(news, {.serial = "1021100042", .epoch = 0, .id = 1});
  CHECK(all_of(path, {}) == std::vector<std::string>{report::to_json(told)});
}

TEST_CASE("results: all of a store is told in parts, in order, each row once") {
  const test::TemporaryFolder folder;
  const std::string path = folder.path() + "/events.db";
  {
    test::StoreMaker maker(path, profiles());
    maker.connect("station1", "1", "doga-bm");
    for (std::uint16_t number = 1; number <= 1'234; ++number) {
      maker.wait(1s);
      if (number == 700) {
        maker.miss(699, 702, "missed");
        continue;
      }
      if (number == 701) continue;
      maker.tell(number, {{"status", 1}, {"torque", 271}});
    }
  }
  const auto lines = all_of(path, {});
  std::vector<std::int64_t> expected;
  for (std::int64_t id = 1; id <= 1'232; ++id) expected.push_back(id);
  CHECK(events_of(lines) == expected);
  REQUIRE(lines.size() == 1'233);
  CHECK(lines[699].find("\"type\":\"gap\"") != std::string::npos);
  CHECK(events_of(all_of(path, {.count = 3})) == std::vector<std::int64_t>{1'230, 1'231, 1'232});
  CHECK(all_of(path, {.count = 533}).front().find("\"type\":\"gap\"") != std::string::npos);
  CHECK(events_of(all_of(path, {.count = 533})).size() == 533);
  CHECK(events_of(all_of(path, {.filter = {.key = "1/0/702"}})) == std::vector<std::int64_t>{700});
}

TEST_CASE("results: what is stored while it is followed is told once, until a signal") {
  const test::TemporaryFolder folder;
  const std::string path = folder.path() + "/events.db";
  test::StoreMaker maker(path, profiles());
  maker.connect("station1", "1", "doga-bm");
  maker.tell(1, {{"status", 1}});
  Stage stage;
  std::uint16_t number = 1;
  for (int round = 1; round <= 20; ++round) {
    stage.clock.at(test::FakeClock::start + round * 130ms, [&] {
      maker.wait(10ms);
      maker.tell(++number, {{"status", 2}});
      if (number == 9) {
        maker.wait(10ms);
        maker.lose("the link was lost");
      }
    });
  }
  stage.clock.at(test::FakeClock::start + 4s, [&] { stage.interrupt.raise(2); });
  const auto outcome = commands::results(
      {.store = path, .following = commands::Following::yes, .count = 1}, stage.context);
  REQUIRE(outcome.has_value());
  CHECK(outcome->status() == ExitStatus::interrupted);
  const auto lines = stage.told();
  std::vector<std::int64_t> expected;
  for (std::int64_t id = 1; id <= 21; ++id) expected.push_back(id);
  CHECK(events_of(lines) == expected);
  CHECK(lines.size() == 22);
  REQUIRE(stage.renderer.summaries().size() == 1);
  CHECK(stage.renderer.summaries().front().plain ==
        "21 events, 1 OK, 20 NG, 1 gap, perhaps some missed");
}

TEST_CASE("results: a tool that comes while the store is followed is known, and one that moves") {
  const test::TemporaryFolder folder;
  const std::string path = folder.path() + "/events.db";
  test::StoreMaker maker(path, profiles());
  maker.connect("station1", "1", "doga-bm");
  maker.tell(1, {{"status", 1}});
  Stage stage;
  stage.clock.at(test::FakeClock::start + 1s, [&] {
    maker.connect("station2", "2", "doga-bm");
    maker.tell(1, {{"status", 1}});
    maker.connect("station1", "3", "doga-bmt");
    maker.tell(1, {{"status", 1}});
  });
  stage.clock.at(test::FakeClock::start + 2s, [&] { stage.interrupt.raise(2); });
  const auto outcome = commands::results(
      {.filter = {.targets = {"station1"}}, .store = path, .following = commands::Following::yes},
      stage.context);
  REQUIRE(outcome.has_value());
  CHECK(events_of(stage.told()) == std::vector<std::int64_t>{1, 3});
  CHECK(stage.told().back().find("\"target\":\"station1\",\"serial\":\"3\"") != std::string::npos);
}

TEST_CASE("results: following what fits seldom does not look at the old rows again") {
  const test::TemporaryFolder folder;
  const std::string path = folder.path() + "/events.db";
  test::StoreMaker maker(path, profiles());
  maker.connect("station1", "1", "doga-bm");
  maker.tell(1, {{"status", 1}});
  Stage stage;
  stage.clock.at(test::FakeClock::start + 1s, [&] { maker.tell(2, {{"status", 2}}); });
  stage.clock.at(test::FakeClock::start + 2s, [&] { stage.interrupt.raise(15); });
  const auto outcome = commands::results(
      {.filter = {.kinds = {"fastening-ng"}}, .store = path, .following = commands::Following::yes},
      stage.context);
  REQUIRE(outcome.has_value());
  CHECK(outcome->status() == ExitStatus::terminated);
  CHECK(events_of(stage.told()) == std::vector<std::int64_t>{2});
}

TEST_CASE("odometer: a tool's own total against what is stored") {
  const test::TemporaryFolder folder;
  const std::string path = folder.path() + "/events.db";
  test::StoreMaker maker(path, profiles());
  const test::StoreMaker::Values ok = {{"status", 1}};
  maker.connect("whole", "1", "doga-bm");
  maker.say_total(100, std::nullopt);
  maker.tell(10, ok, "catch-up", true);  // the total has it
  maker.tell(11, ok);
  maker.tell(12, {{"status", 4}});  // no fastening
  maker.tell(13, ok);
  maker.say_total(102, 13);
  maker.tell(14, ok);
  maker.say_total(104, 14);
  maker.tell(15, ok, "catch-up");  // it happened before that total was said
  maker.tell(16, ok);
  maker.say_total(105, 16);
  maker.connect("lossy", "2", "doga-bm");
  maker.say_total(7, std::nullopt);
  maker.tell(1, ok);
  maker.say_total(11, 1);
  maker.connect("changed", "3", "doga-bm");
  maker.say_total(900, std::nullopt);
  maker.tell(1, ok);
  maker.say_total(3, 1);
  maker.connect("once", "4", "doga-bm");
  maker.say_total(900, std::nullopt);
  maker.tell(1, ok);
  auto reader = store::Reader::open(path).value();
  const auto all = commands::read_mileage(*reader).value();
  REQUIRE(all.size() == 3);
  CHECK(all[0].counted == 5);
  CHECK(all[0].stored == 5);
  CHECK(all[0].missing() == 0);
  CHECK(all[1].missing() == 3);
  CHECK(all[2].missing() == std::nullopt);
}

TEST_CASE("qdas: a part as its format wants it") {
  const WallTime noon = std::chrono::sys_days(std::chrono::year(2026) / 11 / 30) + 12h + 5s + 999ms;
  files::QdasPart part{.number = "pr\xc3\xa4sse\r\n1",
                       .name = "preset \xe2\x82\xac",
                       .characteristics = {{.name = "torque",
                                            .unit = "N.m",
                                            .nominal = Decimal(271, -2),
                                            .lower = Decimal(2439, -3)},
                                           {.name = "angle", .unit = "\xc2\xb0"}}};
  part.rows.push_back({.values = {Decimal(272, -2), Decimal(6301)}, .shown = noon});
  part.rows.push_back({.values = {Decimal(2725, -3), std::nullopt},
                       .use = files::QdasUse::left_out,
                       .shown = noon + 1min});
  CHECK(files::render_qdas(part) ==
        "K0100 2\r\nK1001/1 pr\xe4sse  1\r\nK1002/1 preset ?\r\n"
        "K2001/1 1\r\nK2002/1 torque\r\nK2004/1 0\r\nK2022/1 3\r\nK2101/1 2.71\r\n"
        "K2110/1 2.439\r\nK2120/1 1\r\nK2121/1 0\r\nK2142/1 N.m\r\n"
        "K2001/2 2\r\nK2002/2 angle\r\nK2004/2 0\r\nK2022/2 0\r\nK2120/2 0\r\nK2121/2 0\r\n"
        "K2142/2 \xb0\r\n"
        "2.72\x14"
        "0\x14"
        "30.11.2026/12:00:05\x0f"
        "6301\x14"
        "0\x14"
        "30.11.2026/12:00:05\r\n"
        "2.725\x14"
        "255\x14"
        "30.11.2026/12:01:05\x0f"
        "0\x14"
        "256\x14"
        "30.11.2026/12:01:05\r\n");
}
