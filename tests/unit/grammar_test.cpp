#include "cli/grammar.hpp"

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "spindle/base/text.hpp"

using namespace spindle;
using spindle::cli::Invocation;
using spindle::cli::parse;

namespace {

using Words = std::vector<std::string>;

/// Words as a shell would split them: spaces and single quotes.
Words words(std::string_view line) {
  Words result;
  std::optional<std::string> word;
  bool quoted = false;
  for (const char c : line) {
    if (c == '\'') {
      quoted = !quoted;
      word = word.value_or("");
    } else if (c == ' ' && !quoted) {
      if (word) result.push_back(*word);
      word.reset();
    } else {
      word = word.value_or("") + c;
    }
  }
  if (word) result.push_back(*word);
  return result;
}

std::string help(Words arguments) {
  arguments.emplace_back("--help");
  const auto invocation = parse(arguments);
  REQUIRE(invocation.has_value());
  REQUIRE(invocation->text.has_value());
  return *invocation->text;
}

/// The lines below a heading, up to the next empty line.
std::vector<std::string> section(const std::string& text, std::string_view heading) {
  std::istringstream stream(text);
  std::vector<std::string> lines;
  bool inside = false;
  for (std::string line; std::getline(stream, line);) {
    if (inside && line.empty()) break;
    if (inside) lines.push_back(line);
    if (line == heading) inside = true;
  }
  return lines;
}

/// Every command as one types it: the program itself, its commands, and theirs.
std::vector<Words> all_commands() {
  std::vector<Words> commands = {{}};
  for (std::size_t next = 0; next < commands.size(); ++next) {
    for (const std::string& line : section(help(commands[next]), "Commands:")) {
      Words deeper = commands[next];
      deeper.push_back(words(line).front());
      commands.push_back(std::move(deeper));
      REQUIRE(commands.size() < 100);  // a name that parses as something else would never end
    }
  }
  return commands;
}

struct OptionLine {
  std::string text;
  std::string description;
};

/// What stands in the two columns of a help's lists; a meaning may go on on the next line.
std::vector<OptionLine> option_lines(const std::string& text) {
  std::vector<OptionLine> result;
  for (const std::string_view heading : {"Arguments and options:", "Options of every command:"}) {
    for (const std::string& line : section(text, heading)) {
      const std::size_t begin = line.find_first_not_of(' ');
      const std::size_t column = line.find("  ", begin);
      const bool goes_on = begin > 8 || line.starts_with("  also ");
      if (column == std::string::npos || goes_on) continue;
      result.push_back({line.substr(begin, column - begin),
                        line.substr(std::min(line.find_first_not_of(' ', column), line.size()))});
    }
  }
  return result;
}

Invocation good(std::string_view line) {
  auto invocation = parse(words(line));
  CAPTURE(std::string(line));
  if (!invocation) FAIL(describe(invocation.error()));
  return std::move(*invocation);
}

std::string bad(std::string_view line) {
  const auto invocation = parse(words(line));
  CAPTURE(std::string(line));
  REQUIRE_FALSE(invocation.has_value());
  CHECK(invocation.error().status() == ExitStatus::usage);
  return describe(invocation.error());
}

}  // namespace

TEST_CASE("the commands of this version are there") {
  const auto commands = all_commands();
  for (const char* name : {"identify", "list", "get", "set", "do", "watch", "remote-start",
                           "remote-stop", "alarms", "ping", "simulate", "profile"}) {
    CAPTURE(std::string(name));
    CHECK(std::find(commands.begin(), commands.end(), Words{name}) != commands.end());
  }
  for (const char* name : {"list", "show", "check"}) {
    CHECK(std::find(commands.begin(), commands.end(), Words{"profile", name}) != commands.end());
  }
}

TEST_CASE("every command has examples, before anything else, and each of them parses") {
  for (const Words& command : all_commands()) {
    const std::string text = help(command);
    CAPTURE(text);
    const auto examples = section(text, "Examples:");
    CHECK_FALSE(examples.empty());
    CHECK(text.find("Examples:") < text.find("Usage:"));
    for (const std::string& example : examples) {
      CAPTURE(example);
      Words typed = words(example);
      REQUIRE(typed.front() == "spindle");
      typed.erase(typed.begin());
      REQUIRE(typed.size() >= command.size());
      CHECK(std::equal(command.begin(), command.end(), typed.begin()));
      const auto invocation = parse(typed);
      REQUIRE(invocation.has_value());
      const bool tells = invocation->text || invocation->asks == Invocation::Asks::version;
      CHECK((tells || invocation->run));
    }
  }
}

TEST_CASE("every command says what it does, and every option what it is for") {
  for (const Words& command : all_commands()) {
    const std::string text = help(command);
    CAPTURE(text);
    CHECK(text.front() != '\n');
    CHECK(text.find("Usage: spindle") != std::string::npos);
    CHECK(text.find(" \n") == std::string::npos);
    for (const OptionLine& option : option_lines(text)) {
      CAPTURE(option.text);
      CHECK(option.description.size() > 3);
      CHECK(option.description.front() != ' ');
      CHECK_FALSE(option.description.ends_with('.'));
    }
  }
}

TEST_CASE("no option stands twice in a help, and the common ones stand in that of the program") {
  CHECK(section(help({}), "Options of every command:").size() == 16);
  for (const Words& command : all_commands()) {
    const std::string text = help(command);
    CAPTURE(text);
    CHECK(section(text, "Options of every command:").empty() == !command.empty());
    std::vector<std::string> names;
    for (const OptionLine& option : option_lines(text)) names.push_back(option.text);
    std::sort(names.begin(), names.end());
    CHECK(std::adjacent_find(names.begin(), names.end()) == names.end());
  }
}

TEST_CASE("the help of a command fits 25 lines of 100 columns, and names each of its options") {
  const auto check = [](const cli::CommandDescription& command, const auto& again) -> void {
    Words typed = words(command.name);
    const std::string text = help(typed);
    CAPTURE(text);
    std::istringstream stream(text);
    std::size_t lines = 0;
    for (std::string line; std::getline(stream, line); ++lines) CHECK(line.size() <= 100);
    CHECK(lines <= 25);
    for (const cli::OptionDescription& option : command.options) {
      CAPTURE(option.names.back());
      CHECK(text.find(option.names.back()) != std::string::npos);
    }
    for (const cli::CommandDescription& below : command.commands) again(below, again);
  };
  const cli::Description all = cli::describe_grammar();
  for (const cli::CommandDescription& command : all.commands) check(command, check);
}

TEST_CASE("-n is --dry-run, and -c is --count, wherever there is one") {
  const auto check = [](const cli::CommandDescription& command, const auto& again) -> void {
    for (const cli::OptionDescription& option : command.options) {
      CAPTURE(command.name);
      if (option.names.back() == "--dry-run") CHECK(option.names.front() == "-n");
      if (option.names.back() == "--count") CHECK(option.names.front() == "-c");
      if (option.names.front() == "-n") CHECK(option.names.back() == "--dry-run");
      if (option.names.front() == "-c") CHECK(option.names.back() == "--count");
    }
    for (const cli::CommandDescription& below : command.commands) again(below, again);
  };
  const cli::Description all = cli::describe_grammar();
  for (const cli::CommandDescription& command : all.commands) check(command, check);
}

TEST_CASE("a preset is read with 30 keys, and a torque changed with 40, as the manual says") {
  std::ifstream page(SPINDLE_SOURCE_DIR "/man/spindle.1.in");
  const std::string text{std::istreambuf_iterator<char>(page), {}};
  struct Case {
    std::string command;
    std::size_t keys;
  };
  // With Enter; what the default target makes of it is asked, and answered with y and Enter.
  const Case cases[] = {{"spindle get station3 preset.1", 30},
                        {"spindle set station3 1.target-torque=3", 40},
                        {"spindle get preset.1", 30},
                        {"spindle set 1.target-torque=2.8", 40 - 2}};
  for (const Case& row : cases) {
    CAPTURE(row.command);
    std::string escaped = row.command;
    if (const auto dash = escaped.find("t-t"); dash != std::string::npos) {
      escaped.replace(dash, 3, "t\\-t");
    }
    CHECK(text.find("$ " + escaped + "\n") != std::string::npos);
    CHECK(row.command.size() + 1 <= row.keys);
    Words typed = words(row.command);
    typed.erase(typed.begin());
    CHECK(parse(typed).has_value());
  }
}

TEST_CASE("help is for the innermost command named, wherever --help stands") {
  CHECK(parse(words("--help get"))->text == parse(words("get --help"))->text);
  CHECK(parse(words("get sim:doga-bm -h p1 --json"))->text == parse(words("get -h"))->text);
  CHECK(parse(words("profile --help show"))->text == parse(words("profile show --help"))->text);
  CHECK(parse(words("get --version"))->asks == Invocation::Asks::version);
}

TEST_CASE("common options work before and behind the command's name") {
  for (const char* line :
       {"--profile doga-bm -o csv --tools t.yaml --timeout 250ms --connect-timeout 2s --retries 3 "
        "-y -q -v --color never get sim:doga-bm p1",
        "get --profile doga-bm -o csv --tools t.yaml --timeout 250ms sim:doga-bm --connect-timeout "
        "2s --retries 3 -y -q -v --color never p1",
        "get sim:doga-bm p1 --profile=doga-bm --output=csv --tools=t.yaml --timeout=250ms "
        "--connect-timeout=2s --retries=3 --yes --quiet --verbose --color=never",
        "--yes -v get sim:doga-bm p1 -ocsv --profile doga-bm --tools t.yaml --timeout 250ms -q "
        "--connect-timeout 2s --retries 3 --color never"}) {
    CAPTURE(std::string(line));
    const Invocation typed = good(line);
    CHECK(typed.format == report::Format::csv);
    CHECK(typed.user.verbosity == report::Verbosity::quiet);
    CHECK(typed.color == cli::ColorChoice::never);
    CHECK(typed.common.tools_file == "t.yaml");
    CHECK(typed.common.profile == "doga-bm");
    CHECK(typed.common.timeout == std::chrono::milliseconds(250));
    CHECK(typed.common.connect_timeout == std::chrono::seconds(2));
    CHECK(typed.common.retries == 3U);
    CHECK(typed.user.consent == commands::Consent::given);
    CHECK(typed.user.frames == commands::Frames::shown);
    CHECK(typed.run);
  }
}

TEST_CASE("nothing given: the defaults") {
  const Invocation typed = good("get sim:doga-bm");
  CHECK(typed.format == report::Format::table);
  CHECK(typed.user.verbosity == report::Verbosity::normal);
  CHECK(typed.color == cli::ColorChoice::automatic);
  CHECK_FALSE(typed.common.timeout.has_value());
  CHECK_FALSE(typed.common.retries.has_value());
  CHECK(typed.user.consent == commands::Consent::ask);
  CHECK(typed.user.frames == commands::Frames::hidden);
}

TEST_CASE("--json is -o json, and of several the last one wins") {
  struct Case {
    std::string line;
    report::Format format;
  };
  const std::vector<Case> cases = {
      {"get t --json", report::Format::json},
      {"get t -o json", report::Format::json},
      {"get t -ojson", report::Format::json},
      {"--json get t", report::Format::json},
      {"get t --json --json", report::Format::json},
      {"get t --json -o csv", report::Format::csv},
      {"get t -o csv --json", report::Format::json},
      {"--json get t --output=table", report::Format::table},
      {"-o csv get t --json", report::Format::json},
      {"-o csv get t -o table", report::Format::table},
      {"get t -- --json", report::Format::table},
      {"get -- t -o json", report::Format::table},
  };
  for (const Case& row : cases) {
    CAPTURE(row.line);
    CHECK(good(row.line).format == row.format);
    CHECK(cli::wanted_format(words(row.line)) == row.format);
  }
}

TEST_CASE("repeated options and flags are no error") {
  CHECK(good("-v get t -v --verbose").user.frames == commands::Frames::shown);
  CHECK(good("get t -qq").user.verbosity == report::Verbosity::quiet);
  CHECK(good("get t -yv").user.frames == commands::Frames::shown);
  CHECK(good("--timeout 1s get t --timeout 2s").common.timeout == std::chrono::seconds(2));
  CHECK(good("get t --profile a --profile b").common.profile == "b");
  CHECK(good("set t a=1 --dry-run --dry-run").run);
}

TEST_CASE("no flag takes a value") {
  for (const cli::CommandDescription& command : cli::describe_grammar().commands) {
    for (const cli::OptionDescription& option : command.options) {
      if (!option.is_flag()) continue;
      const std::string& name = option.names.back();
      CHECK(bad(fmt::format("{} t {}=false", command.name, name)) ==
            fmt::format("'{}' takes no value; write {} alone", name, name));
    }
  }
}

TEST_CASE("--yes answers also where no user may be asked") {
  CHECK(good("do t x --no-input").user.consent == commands::Consent::no_input);
  CHECK(good("do t x --no-input --yes").user.consent == commands::Consent::given);
  CHECK(good("do t x --yes --no-input").user.consent == commands::Consent::given);
}

TEST_CASE("arguments that look like options, or are negative, arrive behind -- and =") {
  CHECK(good("set t preset.1.speed=-5").run);
  CHECK(good("set t a=-0.5 b=--c").run);
  CHECK(good("get t -- -x --json").run);
  CHECK(good("get t -5").run);  // a number is no option; no parameter has such a name
}

TEST_CASE("words with brackets around them arrive as they were typed") {
  // What help is wanted of is a list of words, as targets are.
  for (const std::string word : {"[get]", "[get,set]", "[::1]", "[a=1,b=2]"}) {
    CAPTURE(word);
    const auto asked = parse({"help", word});
    REQUIRE_FALSE(asked);
    CHECK(asked.error().message.find(word) != std::string::npos);
  }
}

TEST_CASE("help and version are commands, too, and spindle alone is a question for help") {
  CHECK(good("").text == good("--help").text);
  CHECK(good("help").text == good("--help").text);
  CHECK(good("help get").text == good("get --help").text);
  CHECK(good("help store trim").text == good("store trim --help").text);
  CHECK(good("help -q set").text == good("set --help").text);
  CHECK(good("version").asks == Invocation::Asks::version);
  CHECK(good("version --json").format == report::Format::json);
  CHECK(parse(words("help gte")).error().message == "unknown command 'gte'");
  CHECK(parse(words("help gte")).error().hint == "did you mean 'get'?");
}

TEST_CASE("the help of a command has its own options, and says where the others are") {
  for (const std::string line : {"get --help", "record --help"}) {
    CAPTURE(line);
    const std::string text = *good(line).text;
    CHECK(text.find("--connect-timeout") == std::string::npos);
    CHECK(text.find("'spindle --help'") != std::string::npos);
  }
}

TEST_CASE("what is wrong is named, with a suggestion or where to look") {
  struct Case {
    std::string line;
    std::string text;
  };
  const std::vector<Case> cases = {
      {"--json", "no command is given; 'spindle --help' lists all commands"},
      {"gte t", "unknown command 'gte'; did you mean 'get'?"},
      {"gte --help", "unknown command 'gte'; did you mean 'get'?"},
      {"profile lsit", "unknown command 'lsit'; did you mean 'list'?"},
      {"get t --limit", "unknown option '--limit'; did you mean '--limits'?"},
      {"get t --limits=yes", "'--limits' takes no value; write --limits alone"},
      {"get t --verbos=2", "unknown option '--verbos'; did you mean '--verbose'?"},
      {"get t --dry-run", "unknown option '--dry-run'; 'spindle get --help' lists all options"},
      {"get t --profile", "'--profile' needs a value; write --profile VALUE"},
      {"get t -o", "'-o' needs a value; write -o VALUE"},
      {"get t -o jsn",
       "--output: 'jsn' is unknown; it takes table, json, csv, svg, wide, value, yaml; did you "
       "mean 'json'?"},
      {"get t --timeout 5", "--timeout: '5' is not a duration; write it like 500ms, 2.5s or 5min"},
      {"get t --timeout -1s",
       "--timeout: '-1s' is not a duration; write it like 500ms, 2.5s or 5min"},
      {"get t --retries 101", "--retries: '101' does not fit; it takes a number from 0 to 100"},
      {"use t u", "use: 'u' is one argument too many; 'spindle use --help' shows examples"},
      {"profile show a b",
       "profile show: 'b' is one argument too many; 'spindle profile show --help' shows examples"},
  };
  for (const Case& row : cases) {
    CAPTURE(row.line);
    CHECK(bad(row.line) == row.text);
  }
}

TEST_CASE(
    "record without a tool is about all of the tools file, and with a URL it waits for none") {
  CHECK(parse(words("record"))->tools_use == Invocation::ToolsFile::all_tools);
  CHECK(parse(words("record --store a.db --tee"))->tools_use == Invocation::ToolsFile::all_tools);
  CHECK(parse(words("record station3"))->tools_use == Invocation::ToolsFile::all_tools);
  CHECK(parse(words("record tcp://h"))->tools_use == Invocation::ToolsFile::only_found);
  CHECK(parse(words("results"))->tools_use == Invocation::ToolsFile::only_found);
}

TEST_CASE("a default target needs the tools file, and a URL only what can be read of it") {
  using ToolsFile = Invocation::ToolsFile;
  CHECK(parse(words("get preset.1.*"))->tools_use == ToolsFile::loaded);
  CHECK(parse(words("get"))->tools_use == ToolsFile::loaded);
  CHECK(parse(words("set a=1"))->tools_use == ToolsFile::loaded);
  CHECK(parse(words("set station3 a=1"))->tools_use == ToolsFile::loaded);
  CHECK(parse(words("get tcp://h"))->tools_use == ToolsFile::only_found);
  CHECK(parse(words("get tcp://h p2"))->tools_use == ToolsFile::salvaged);
  CHECK(parse(words("remote-stop"))->tools_use == ToolsFile::salvaged);
  CHECK(parse(words("remote-stop tcp://h"))->tools_use == ToolsFile::only_found);
  CHECK(parse(words("use"))->tools_use == ToolsFile::only_found);
}
