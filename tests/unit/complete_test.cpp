#include "cli/complete.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "cli/grammar.hpp"
#include "spindle/posix/disk.hpp"
#include "support/memory_disk.hpp"

using namespace spindle;
using cli::Completion;
using cli::Paths;
using Words = std::vector<std::string>;

namespace {

const files::ProfileStore& shipped() {
  static const files::ProfileStore store({SPINDLE_SOURCE_DIR "/profiles"}, posix::source_disk());
  return store;
}

Completion offered(const Words& words) {
  const files::Tools tools{
      .path = "spindle.yaml",
      .tools = {{.name = "station3", .url = "tcp://10.0.0.3", .profile = "doga-bm"},
                {.name = "bare", .url = "tcp://10.0.0.4", .profile = ""}},
      .groups = {{"line1", {"bare", "station3"}}, {"single", {"bare"}}}};
  return cli::complete(words, cli::describe_grammar(), {tools, shipped()});
}

Words texts(const Words& words) {
  Words all;
  for (const cli::Candidate& candidate : offered(words).candidates) all.push_back(candidate.text);
  return all;
}

bool has(const Words& words, const std::string& text) {
  const Words all = texts(words);
  return std::find(all.begin(), all.end(), text) != all.end();
}

}  // namespace

TEST_CASE("complete: commands, options and their choices come from the grammar") {
  const cli::Description description = cli::describe_grammar();
  CHECK(texts({""}).size() == description.commands.size());
  for (const cli::CommandDescription& command : description.commands) {
    CAPTURE(command.name);
    CHECK(texts({command.name.substr(0, command.name.size())}) == Words{command.name});
    for (const cli::OptionDescription& option : command.options) {
      if (!option.is_argument()) CHECK(has({command.name, "--"}, option.names.back()));
    }
    for (const cli::OptionDescription& option : description.common) {
      CHECK(has({command.name, "--"}, option.names.back()));
    }
  }
}

TEST_CASE("complete: what a word stands for depends on those before it") {
  struct Row {
    Words words;
    Words expected;
  };
  const std::vector<Row> rows = {
      {{"get", "sta"}, {"station3"}},
      {{"get", "station3", "event.num"}, {"event.number"}},
      {{"get", "--limits", "station3", "event.num"}, {"event.number"}},
      {{"--output", "csv", "get", "station3", "event.num"}, {"event.number"}},
      {{"--output", "get"}, {}},
      {{"get", "--timeout", "station3", "event.num"}, {}},
      {{"get", "bare", "event.num"}, {}},
      {{"get", "bare", "--profile", "doga-bm", "event.num"}, {"event.number"}},
      {{"get", "--profile=doga-bm", "tcp://10.0.0.9", "event.num"}, {"event.number"}},
      {{"get", "sim:doga-bm", "event.num"}, {"event.number"}},
      {{"list", "event.num"}, {}},
      {{"list", "--profile", "doga-bm", "event.num"}, {"event.number"}},
      {{"watch", "station3", "bare", "event.num"}, {"event.number"}},
      {{"watch", "station3", "ba"}, {"bare"}},
      {{"set", "station3", "preset.1.mode="}, {"preset.1.mode=TC/AM", "preset.1.mode=AC/TM"}},
      {{"set", "station3", "event.num"}, {}},
      {{"do", "station3", "select-preset=1", "dir"}, {"direction="}},
      {{"get", "--", "--"}, {}},
      {{"ping", "station3", "sta"}, {"station3"}},
      {{"profile", "show", "doga-bmt"}, {"doga-bmt"}},
      {{"get", "nowhere", "p"}, {}},
      {{"get", "@line1", "event.num"}, {"event.number"}},
      {{"set", "@line1", "preset.1.mode="}, {"preset.1.mode=TC/AM", "preset.1.mode=AC/TM"}},
      {{"do", "@line1", "dir"}, {"direction="}},
      {{"get", "@single", "event.num"}, {}},
      {{"get", "@elsewhere", "event.num"}, {}},
      {{"learn", "sim:doga-gen2", "sel"}, {"select-preset"}},
      {{"learn", "sim:doga-bm", ""}, {}},
      {{"do", "sim:doga-gen2", "find"}, {"find-event-block"}},
  };
  for (const Row& row : rows) {
    CAPTURE(row.words.back());
    CHECK(texts(row.words) == row.expected);
  }
  CHECK(offered({}).candidates.size() == offered({""}).candidates.size());
}

TEST_CASE("complete: options are those that the profile declares") {
  CHECK(has({"remote-start", "sim:doga-bm", "--"}, "--preset"));
  CHECK_FALSE(has({"remote-start", "sim:doga-bm", "--"}, "--speed"));
  CHECK(has({"remote-start", "sim:orientalmotor-blv", "--"}, "--watchdog"));
  CHECK_FALSE(has({"remote-start", "sim:orientalmotor-blv", "--"}, "--direction"));
  CHECK(has({"remote-start", "sim:doga-bm", "--"}, "--for"));
  CHECK(has({"remote-start", "--"}, "--speed"));
  CHECK(has({"simulate", "doga-bm", "--"}, "--rundown-every"));
  CHECK_FALSE(has({"simulate", "doga-bm", "--"}, "--busy"));
  CHECK(has({"simulate", "orientalmotor-blv", "--"}, "--busy"));
  CHECK_FALSE(has({"simulate", "orientalmotor-blv", "--"}, "--firmware"));
  CHECK(has({"simulate", "orientalmotor-blv", "--"}, "--units"));
}

TEST_CASE("complete: a group is offered where several tools make sense") {
  for (const char* command : {"identify", "get", "set", "do", "watch", "remote-stop", "alarms",
                              "backup", "ping", "diff", "restore"}) {
    CAPTURE(command);
    CHECK(texts({command, "@"}) == Words{"@line1", "@single"});
  }
  for (const char* command : {"list", "remote-start", "scan", "dump", "learn"}) {
    CAPTURE(command);
    CHECK(texts({command, "@"}) == Words{"@single"});
  }
}

TEST_CASE("complete: kinds of events") {
  CHECK(texts({"results", "--kind", ""}) == catalogue::event_kind_words.words());
}

TEST_CASE("complete: tables of registers, and how they are numbered") {
  CHECK(texts({"scan", "station3", "--table", ""}) == modbus::table_words.words());
  CHECK(texts({"profile", "new", "x", "--numbering", ""}) == Words{"address", "modicon"});
  CHECK(texts({"profile", "new", ""}).empty());
}

TEST_CASE("complete: many names are offered head by head") {
  CHECK(texts({"get", "station3", "preset.1"}).size() == 7);  // preset.1., preset.10. to preset.15.
  CHECK(texts({"get", "station3", "preset.1."}).size() == 15);
  CHECK(has({"get", "station3", ""}, "preset."));
}

TEST_CASE("complete: files where files are meant") {
  CHECK(offered({"get", "--tools", ""}).paths == Paths::files);
  CHECK(offered({"get", "--profile", ""}).paths == Paths::files);
  CHECK(offered({"profile", "check", ""}).paths == Paths::files);
  CHECK(offered({"get", ""}).paths == Paths::none);
  CHECK(cli::to_text(offered({"get", "--tools", ""})) == "files\n");
  CHECK(cli::to_text(offered({"get", "sta"})) == "none\nstation3\ttcp://10.0.0.3\n");
}

TEST_CASE("complete: an entry with a fault is not offered") {
  const files::Tools tools{.path = "spindle.yaml",
                           .tools = {{.name = "station3", .url = "tcp://10.0.0.3"},
                                     {.name = "station4", .url = "tcp://10.0.0.4"}},
                           .groups = {{"line1", {"station3"}}, {"line2", {"station3"}}},
                           .faults = {{"station4", Error{}}, {"@line2", Error{}}}};
  const auto offered_of = [&](const Words& words) {
    Words all;
    for (const auto& one :
         cli::complete(words, cli::describe_grammar(), {tools, shipped()}).candidates) {
      all.push_back(one.text);
    }
    return all;
  };
  CHECK(offered_of({"get", "sta"}) == Words{"station3"});
  CHECK(offered_of({"get", "@"}) == Words{"@line1"});
  CHECK(offered_of({"tools", "test", "sta"}) == Words{"station3"});
  CHECK(offered_of({"tools", "add", "--profile", "doga-bm", "pre"}).empty());
}

TEST_CASE("complete: names of a tool that was seen") {
  test::MemoryDisk files;
  const Disk disk = files.functions();
  const work::ToolMemory memory(disk, "/cache");
  REQUIRE(memory.remember(
      {.host = "10.0.0.4", .port = 5000, .profile = "doga-bm", .serial = "1021100042"}));
  const files::Tools tools{.path = "spindle.yaml",
                           .tools = {{.name = "bare", .url = "tcp://10.0.0.4"}}};
  for (const char* target : {"bare", "tcp://10.0.0.4:5000", "10.0.0.4"}) {
    CAPTURE(target);
    const auto found = cli::complete({"get", target, "event.num"}, cli::describe_grammar(),
                                     {tools, shipped(), &memory});
    REQUIRE(found.candidates.size() == 1);
    CHECK(found.candidates.front().text == "event.number");
  }
  CHECK(cli::complete({"get", "tcp://10.0.0.5", "event.num"}, cli::describe_grammar(),
                      {tools, shipped(), &memory})
            .candidates.empty());
}

TEST_CASE("complete: where no tool is typed, the names are those of the default target") {
  const files::Tools tools{
      .path = "spindle.yaml",
      .tools = {{.name = "station3", .url = "tcp://10.0.0.3", .profile = "doga-bm"},
                {.name = "bare", .url = "tcp://10.0.0.4", .profile = ""}},
      .groups = {{"line1", {"bare", "station3"}}}};
  const auto count = [&](const Words& words, const std::string& usual) {
    return cli::complete(words, cli::describe_grammar(), {tools, shipped(), nullptr, usual})
        .candidates.size();
  };
  for (const std::string usual : {"station3", "@line1", "sim:doga-bm"}) {
    CAPTURE(usual);
    CHECK(count({"get", "event.num"}, usual) == 1);
    CHECK(count({"get", "event.number", "event.num"}, usual) == 1);
    CHECK(count({"set", "preset.1.target-t"}, usual) == 1);
    // A tool that is typed is meant, also where nothing is known of it.
    CHECK(count({"get", "bare", "event.num"}, usual) == 0);
  }
  CHECK(count({"get", "event.num"}, "") == 0);
  CHECK(count({"get", "event.num"}, "bare") == 0);
}
