#include "spindle/work/target.hpp"

#include <doctest/doctest.h>

#include <string>
#include <vector>

#include "spindle/posix/disk.hpp"
#include "spindle/work/connect.hpp"
#include "spindle/work/identification.hpp"
#include "spindle/work/shared_lines.hpp"
#include "spindle/work/side_by_side.hpp"
#include "support/rig.hpp"

using namespace spindle;
using namespace spindle::work;

namespace {

/// A world with one tools file and, at 192.168.10.23:5000, one simulated tool.
struct Bench : test::BmRig {
  explicit Bench(const sim::DeviceOptions& how = {}) : BmRig(test::product("doga-bm"), how) {
    tools.path = "spindle.yaml";
    tools.tools = {{.name = "station3",
                    .url = "tcp://192.168.10.23",
                    .profile = "doga-bm",
                    .torque_unit = "N.m",
                    .verified = {"select-preset"}},
                   {.name = "station4",
                    .url = "tcp://192.168.10.24:6000?unit=3",
                    .profile = {},
                    .torque_unit = {}},
                   {.name = "bench", .url = "sim:doga-bmt", .profile = {}, .torque_unit = {}}};
    tools.groups = {{"line1", {"station3", "station4"}}, {"single", {"station4"}}};
  }

  Environment context() {
    return {.clock = clock,
            .interrupt = interrupt,
            .open = lines,
            .uninterruptible = without_end,
            .disk = disk,
            .state_folder = state_folder,
            .version = "1.2.3",
            .profiles = profiles,
            .tools = tools,
            .show_frames = show_frames,
            .common = common};
  }

  Result<std::unique_ptr<link::Transport>> connect_to(const link::Endpoint& to) {
    opened.push_back(to.host + ":" + std::to_string(to.port.value_or(0)));
    if (opened.back() != "192.168.10.23:5000") {
      return tl::unexpected(Error{.code = Errc::connection_refused});
    }
    return transport(clock, interrupt);
  }

  std::vector<std::string> opened;
  device::OpenTransport lines = [this](const auto& to, const auto&, Duration) {
    return connect_to(to);
  };
  work::Uninterruptible without_end{clock, interrupt, lines};
  Disk disk = {};
  std::string state_folder = {};
  files::ProfileStore profiles{{SPINDLE_SOURCE_DIR "/profiles"}, posix::source_disk()};
  files::Tools tools;
  ShowFrames show_frames = {};
  CommonOptions common = {};
};

std::vector<std::string> shown(const Result<std::vector<Target>>& targets) {
  std::vector<std::string> names;
  if (targets) {
    for (const Target& target : *targets) names.push_back(target.shown);
  }
  return names;
}

Result<OpenTool> open(const std::string& text, Need need, Bench& bench) {
  const Environment context = bench.context();
  const auto target = resolve_target(text, context);
  if (!target) return tl::unexpected(target.error());
  auto profile = load_profile(*target, context);
  if (!profile) return tl::unexpected(profile.error());
  return open_tool(*target, std::move(*profile), need, Purpose::read, context);
}

}  // namespace

TEST_CASE("names, groups and URLs become targets, each once, in the order given") {
  Bench bench;
  const Environment context = bench.context();
  using Names = std::vector<std::string>;
  CHECK(shown(resolve_targets({"station4", "tcp://1.2.3.4", "@line1"}, context)) ==
        Names{"station4", "tcp://1.2.3.4", "station3"});
  CHECK(shown(resolve_targets({"@single"}, context)) == Names{"station4"});
}

TEST_CASE("a named tool brings what the tools file knows") {
  Bench bench;
  const auto target = resolve_target("station3", bench.context());
  REQUIRE(target.has_value());
  CHECK(target->endpoint.text == "tcp://192.168.10.23");
  CHECK(target->profile == "doga-bm");
  CHECK(target->torque_unit == "N.m");
  CHECK(target->verified == std::vector<std::string>{"select-preset"});
  CHECK(resolve_target("station4", bench.context())->endpoint.unit == modbus::UnitId{3});
  CHECK(resolve_target("bench", bench.context())->profile == "doga-bmt");
}

TEST_CASE("--profile goes before the tools file and before sim:") {
  Bench bench;
  bench.common.profile = "mine";
  for (const char* text : {"station3", "station4", "bench", "sim:doga-bm", "tcp://1.2.3.4"}) {
    CAPTURE(std::string(text));
    CHECK(resolve_target(text, bench.context())->profile == "mine");
  }
}

TEST_CASE("what is no target says what is near, or what there is") {
  Bench bench;
  struct Case {
    std::string text;
    Errc code;
    std::string description;
  };
  const std::vector<Case> cases = {
      {"staton3", Errc::unknown_name, "unknown target 'staton3'; did you mean 'station3'?"},
      {"@line", Errc::unknown_name, "unknown target '@line'; did you mean '@line1'?"},
      {"elsewhere", Errc::unknown_name,
       "unknown target 'elsewhere'; name a tool of spindle.yaml, or a URL such as tcp://HOST"},
      {"@line1", Errc::usage,
       "'@line1' is 2 tools, and this command takes one; name one of them, such as station3"},
  };
  for (const Case& row : cases) {
    CAPTURE(row.text);
    const auto target = resolve_target(row.text, bench.context());
    REQUIRE_FALSE(target.has_value());
    CHECK(target.error().code == row.code);
    CHECK(describe(target.error()) == row.description);
  }
}

TEST_CASE("a first argument is a target when it is a URL, a tool or a group") {
  Bench bench;
  for (const char* text : {"tcp://x", "sim:doga-bm", "rtu:///dev/ttyUSB0", "station3", "@line1"}) {
    CAPTURE(std::string(text));
    CHECK(is_target(text, bench.context()));
  }
  for (const char* text : {"preset.1.mode", "p2", "*", "@holding:2", "@line9", ""}) {
    CAPTURE(std::string(text));
    CHECK_FALSE(is_target(text, bench.context()));
  }
}

TEST_CASE("a URL without a port takes the profile's, else 502 and a hint which it might be") {
  Bench bench;
  const auto tool = open("station3", Need::named_registers, bench);
  REQUIRE(tool.has_value());
  CHECK(tool->target.endpoint.text == "tcp://192.168.10.23:5000");

  const auto guessed = open("tcp://192.168.10.23", Need::named_registers, bench);
  REQUIRE_FALSE(guessed.has_value());
  CHECK(bench.opened.back() == "192.168.10.23:502");
  CHECK(describe(guessed.error()) ==
        "tcp://192.168.10.23:502: connection refused; no port is named, and BM tools listen on "
        "port 5000: add :5000 or --profile doga-bm");

  const auto given = open("tcp://192.168.10.23:6000", Need::named_registers, bench);
  CHECK(given.error().hint.empty());
}

TEST_CASE("a profile that was not named is found by asking the tool") {
  Bench bench;
  const auto tool = open("tcp://192.168.10.23:5000", Need::named_registers, bench);
  REQUIRE(tool.has_value());
  CHECK(tool->device.profile().id == "doga-bm");
}

TEST_CASE("a tool that fits no profile gives only raw registers, with or without --profile") {
  struct Case {
    std::string what;
    sim::DeviceOptions tool;
    Errc unnamed;
  };
  const std::vector<Case> cases = {
      {"a later generation", {.firmware = 4001}, Errc::wrong_generation},
      {"an unknown model", {.tool_model = 99}, Errc::mismatch},
  };
  for (const Case& row : cases) {
    CAPTURE(row.what);
    Bench bench(row.tool);
    const auto unnamed = open("tcp://192.168.10.23:5000", Need::named_registers, bench);
    REQUIRE_FALSE(unnamed.has_value());
    CHECK(unnamed.error().code == row.unnamed);
    CHECK(unnamed.error().status() == ExitStatus::mismatch);
    const auto named = open("station3", Need::named_registers, bench);
    REQUIRE_FALSE(named.has_value());
    CHECK(named.error().status() == ExitStatus::mismatch);
    CHECK(named.error().target == "station3");
    CHECK(open("tcp://192.168.10.23:5000", Need::raw_registers, bench).has_value());
    CHECK(open("station3", Need::raw_registers, bench).has_value());
  }
}

TEST_CASE("names are checked before connecting where the profile is known") {
  Bench bench;
  const Environment context = bench.context();
  const auto target = resolve_target("station3", context);
  const auto opened = open_prepared(
      *target, Need::named_registers, Purpose::read, context,
      [](const catalogue::Profile& profile) { return profile.select({"preset.1.torqe"}); });
  REQUIRE_FALSE(opened.has_value());
  CHECK(opened.error().code == Errc::unknown_name);
  CHECK(bench.opened.empty());
}

TEST_CASE("an answer is matched against all profiles, or against one") {
  Bench bench;
  const Environment context = bench.context();
  // Four bytes of serial tell nothing of the product; five with 19 in the middle are a BMT.
  const Bytes short_answer = {0, 1, 0, 1, 0, 3, 0x08, 0x37, 0x3C, 0xDC, 0xC0, 0x0A};
  const Bytes bmt_answer = {0, 1, 0, 2, 0, 9, 0x08, 0xA7, 0x2A, 0x07, 0x13, 0x17, 0x01};
  const auto both = match_identity(short_answer, {}, context);
  CHECK(both->candidates == std::vector<std::string>{"doga-bm", "doga-bmt"});
  CHECK(both->profile.empty());
  CHECK(both->series == "BM or BMT");
  CHECK(both->generation == catalogue::Generation::known);

  CHECK(match_identity(bmt_answer, {}, context)->profile == "doga-bmt");
  const auto misfit = match_identity(bmt_answer, "doga-bm", context);
  CHECK(misfit->candidates.empty());
  CHECK(misfit->identity.notes ==
        std::vector<std::string>{"the serial number is that of a doga-bmt, not of a doga-bm"});
  const auto foreign = match_identity(Bytes{1, 2, 3}, {}, context);
  CHECK(foreign->generation == catalogue::Generation::unknown);
  CHECK(foreign->identity.raw == Bytes{1, 2, 3});
}

// ---- gateways ----

namespace {

std::vector<std::string> gateways(const std::vector<std::string>& texts, Bench& bench) {
  const auto targets = resolve_targets(texts, bench.context());
  REQUIRE(targets.has_value());
  std::vector<std::string> names;
  for (const Target& target : *targets) names.push_back(target.endpoint.gateway);
  return names;
}

}  // namespace

TEST_CASE("units that are named behind one host and port share its connection") {
  Bench bench;
  using Names = std::vector<std::string>;
  const auto at = [](const std::string& rest) { return "tcp://g" + rest; };
  CHECK(gateways({at("?unit=1"), at("?unit=2"), at(":502?unit=3")}, bench) ==
        Names{"tcp://g:502", "tcp://g:502", "tcp://g:502"});
  CHECK(gateways({at(":1?unit=1"), at(":2?unit=1"), at(":1?unit=2"), at(":1?unit=1")}, bench) ==
        Names{"tcp://g:1", "", "tcp://g:1"});  // the last one is the first
  CHECK(gateways({at("?unit=1")}, bench) == Names{""});
  CHECK(gateways({at("?unit=1"), at("")}, bench) == Names{"", ""});
  CHECK(gateways({at("?unit=1"), "tcp://h?unit=2"}, bench) == Names{"", ""});
  CHECK(gateways({"rtu+tcp://g:502?unit=1", at("?unit=2"), at("?unit=3")}, bench) ==
        Names{"", "tcp://g:502", "tcp://g:502"});

  const auto targets = resolve_targets({at("?unit=1"), at("?unit=2"), "tcp://h"}, bench.context());
  CHECK(by_line(*targets) == std::vector<std::vector<std::size_t>>{{0, 1}, {2}});
  CHECK(check_same_settings(*targets, std::vector<catalogue::LinkSpec>(3)));
}

TEST_CASE("the port of a profile counts, and what pushes its events has its own connection") {
  Bench bench;
  using Names = std::vector<std::string>;
  const auto add = [&](const std::string& name, const std::string& url,
                       const std::string& profile) {
    bench.tools.tools.push_back({.name = name, .url = url, .profile = profile});
  };
  add("one", "tcp://g?unit=1", "kolver-kducer");
  add("two", "tcp://g:502?unit=2", "kolver-kducer");
  add("three", "tcp://g:5000?unit=3", "doga-bm");
  add("four", "tcp://g:5000?unit=4", "doga-bm");
  add("five", "tcp://g:5000?unit=5", "");
  CHECK(gateways({"one", "two", "three", "four", "five"}, bench) ==
        Names{"tcp://g:502", "tcp://g:502", "", "", ""});
}

TEST_CASE("a unit whose connection others may come to share names its gateway, also alone") {
  Bench bench;
  const auto gateway = [&](const std::string& url, const std::string& profile) {
    bench.tools.tools = {{.name = "one", .url = url, .profile = profile}};
    const auto targets = resolve_targets({"one"}, bench.context());
    REQUIRE(targets.has_value());
    CHECK(targets->front().endpoint.gateway.empty());
    return naming_gateways(*targets, bench.context()).front().endpoint.gateway;
  };
  CHECK(gateway("tcp://g?unit=1", "kolver-kducer") == "tcp://g:502");
  CHECK(gateway("tcp://g", "kolver-kducer").empty());
  CHECK(gateway("tcp://g:5000?unit=3", "doga-bm").empty());
  CHECK(gateway("tcp://g?unit=1", "").empty());
  CHECK(gateway("rtu+tcp://g:1?unit=1", "orientalmotor-blv").empty());
}

TEST_CASE("where ids are ignored a tool must be told by its unit, and send nothing unasked") {
  Bench bench;
  bench.tools.tools.push_back({.name = "deaf",
                               .url = "tcp://192.168.10.23?transaction=echoed",
                               .profile = "doga-bm",
                               .transactions = modbus::TransactionIds::ignored});
  const auto target = resolve_target("deaf", bench.context());
  CHECK(target->endpoint.transactions == modbus::TransactionIds::ignored);
  const auto tool = open("deaf", Need::named_registers, bench);
  REQUIRE_FALSE(tool);
  CHECK(tool.error().code == Errc::usage);
  CHECK(message_of(tool.error()).find("only the id tells an answer from its events") !=
        std::string::npos);
  CHECK(bench.opened.empty());
  // Found out by its answer.
  const auto found =
      open("tcp://192.168.10.23:5000?transaction=ignored", Need::named_registers, bench);
  REQUIRE_FALSE(found);
  CHECK(found.error().code == Errc::usage);
}

TEST_CASE("a tool whose entry has a fault keeps no other from being used") {
  Bench bench;
  bench.tools.faults.emplace("station4",
                             Error{.code = Errc::bad_file, .message = "spindle.yaml:3:1: no"});
  const auto group = resolve_targets({"@line1"}, bench.context());
  REQUIRE(group.has_value());
  REQUIRE(group->size() == 2);
  CHECK(group->front().fault.empty());
  CHECK(group->back().shown == "station4");
  CHECK(group->back().fault == "spindle.yaml:3:1: no");
  const auto opened = load_profile(group->back(), bench.context());
  REQUIRE_FALSE(opened);
  CHECK(opened.error().code == Errc::bad_file);
  CHECK(opened.error().target == "station4");
  CHECK_FALSE(connect_device(group->back(), catalogue::Profile(), bench.context()));
  CHECK(bench.opened.empty());

  for (const char* alone : {"station4", "@single"}) {
    const auto refused = resolve_targets({alone}, bench.context());
    REQUIRE_FALSE(refused);
    CHECK(refused.error().message == "spindle.yaml:3:1: no");
  }
  const Resolution each = resolve_each_target({"@line1"}, bench.context());
  CHECK(each.targets.size() == 1);
  REQUIRE(each.faults.size() == 1);
  CHECK(each.faults.front().target == "station4");
}
