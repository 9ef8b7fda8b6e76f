// The manual pages: made from their sources, complete, and true to the code. SPINDLE_UPDATE=1
// rewrites them.
#include "support/manual.hpp"

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "cli/grammar.hpp"
#include "cli/help.hpp"
#include "files/known_keys.hpp"
#include "spindle/files/profile_store.hpp"
#include "spindle/files/tools_file.hpp"
#include "spindle/posix/disk.hpp"
#include "support/key_examples.hpp"
#include "support/key_manual.hpp"
#include "support/schema_manual.hpp"

using namespace spindle;
namespace fs = std::filesystem;

namespace {

const fs::path root = SPINDLE_SOURCE_DIR;
const fs::path manual = root / "man";
const std::vector<std::string> pages = {"spindle.1",         "spindle-profile.5", "spindle-tools.5",
                                        "spindle-backup.5",  "spindle-json.7",    "spindle-plant.7",
                                        "spindle-tutorial.7"};

std::string read(const fs::path& path) {
  std::ifstream file(path);
  REQUIRE_MESSAGE(file.good(), path);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

test::Placeholder example(std::string name, const std::string& file) {
  std::vector<std::string> lines;
  std::istringstream text(read(manual / "examples" / file));
  for (std::string line; std::getline(text, line);) lines.push_back(line);
  return {std::move(name), test::mdoc_literal(lines)};
}

/// What examples of keys come from: files that tests or the build hold to be right.
test::KeyExamples key_examples() {
  test::KeyExamples examples;
  for (const char* folder : {"profiles", "man/examples", "tests/profiles/good"}) {
    std::set<fs::path> files;
    for (const auto& entry : fs::directory_iterator(root / folder))
      if (entry.path().extension() == ".yaml") files.insert(entry.path());
    for (const fs::path& file : files) examples.add(read(file));
  }
  return examples;
}

std::vector<test::Placeholder> all_placeholders() {
  std::vector<test::Placeholder> placeholders = test::manual_placeholders(cli::describe_grammar());
  const auto schema = nlohmann::ordered_json::parse(read(root / "share" / "spindle-1.schema.json"));
  for (test::Placeholder& placeholder : test::schema_placeholders(schema))
    placeholders.push_back(std::move(placeholder));
  std::vector<std::string> without;
  for (test::Placeholder& placeholder : test::key_placeholders(key_examples(), without))
    placeholders.push_back(std::move(placeholder));
  placeholders.push_back(example("EXAMPLE_TOOLS", "tools.yaml"));
  placeholders.push_back(example("EXAMPLE_PLANT", "plant.yaml"));
  placeholders.push_back(example("EXAMPLE_LINE1", "line1.yaml"));
  placeholders.push_back(example("EXAMPLE_EXTENSION", "bm-line1.yaml"));
  placeholders.push_back(example("EXAMPLE_PROFILE", "my-driver.yaml"));
  placeholders.push_back(example("EXAMPLE_ENCODINGS", "any-device.yaml"));
  return placeholders;
}

/// What the first group of a pattern finds.
std::set<std::string> found(const std::string& text, const std::string& pattern) {
  const std::regex expression(pattern);
  std::set<std::string> all;
  for (auto at = std::sregex_iterator(text.begin(), text.end(), expression);
       at != std::sregex_iterator(); ++at) {
    all.insert((*at)[1]);
  }
  return all;
}

std::string sources(const fs::path& folder, const std::string& prefix) {
  std::string text;
  for (const auto& entry : fs::directory_iterator(root / "src" / folder)) {
    const fs::path& path = entry.path();
    const bool wanted = path.extension() == ".cpp" && path.stem().string().starts_with(prefix);
    if (wanted) text += read(path);
  }
  return text;
}

/// The names of all these keys, and of those inside them.
void add_names(const std::vector<files::Key>& keys, std::set<std::string>& names) {
  for (const files::Key& key : keys) {
    names.emplace(key.name);
    if (key.inner != nullptr) add_names(key.inner(), names);
  }
}

/// Whether a page has a word behind one of the macros that mark keys and fixed words.
bool explains(const std::string& page, const std::string& word) {
  const std::regex marked(
      fmt::format(R"re((^|\n)\.(It )?(Pq )?(Ic|Cm|Ev)( [^\n]*)? {}( [^\n]*)?\n)re",
                  std::regex_replace(word, std::regex(R"re([.%])re"), R"re((\\&)?\$&)re")));
  return std::regex_search(page, marked) ||
         std::regex_search(page, std::regex(fmt::format(R"re(\n\.(It )?(Ic|Cm|Ev) {}\n)re", word)));
}

}  // namespace

TEST_CASE("manual: every page is what its source and the program make of it") {
  const std::vector<test::Placeholder> placeholders = all_placeholders();
  for (const std::string& name : pages) {
    CAPTURE(name);
    const auto page = test::expand_template(read(manual / (name + ".in")), placeholders);
    REQUIRE_MESSAGE(page.has_value(), page.error().name);
    if (std::getenv("SPINDLE_UPDATE") != nullptr) {
      std::ofstream file(manual / name);
      file << *page;
    }
    CHECK_MESSAGE(*page == read(manual / name), "SPINDLE_UPDATE=1 rewrites it");
    CHECK(page->find_first_not_of("\n !\"#$%&'()*+,-./0123456789:;<=>?@ABCDEFGHIJKLMNOPQRSTUVWXYZ"
                                  "[\\]^_`abcdefghijklmnopqrstuvwxyz{|}~") == std::string::npos);
  }
}

TEST_CASE("manual: every placeholder is used, and one that is left empty is told") {
  std::string all;
  for (const std::string& name : pages) all += read(manual / (name + ".in"));
  for (const test::Placeholder& placeholder : all_placeholders()) {
    CAPTURE(placeholder.name);
    CHECK(all.find("\n@" + placeholder.name + "@\n") != std::string::npos);
  }
  const auto page = test::expand_template("before\n@UNKNOWN@\n", all_placeholders());
  REQUIRE_FALSE(page.has_value());
  CHECK(page.error().code == Errc::bad_file);
  CHECK(page.error().name == "UNKNOWN");
}

TEST_CASE("manual: a page is filled line by line") {
  const std::vector<test::Placeholder> placeholders = {{"A", ".Pp\nmore\n"}, {"EMPTY", ""}};
  CHECK(test::expand_template("x\n@A@\ny @A@\n@EMPTY@\n@@\n", placeholders) ==
        "x\n.Pp\nmore\ny @A@\n@@\n");
}

TEST_CASE("manual: text is neither a request, an escape nor a typographic character") {
  CHECK(test::mdoc_escaped(R"(a\b 'c' "d" `e` ^~-)") ==
        R"(a\eb \(aqc\(aq \(dqd\(dq \(gae\(ga \(ha\(ti\-)");
  CHECK(test::mdoc_argument("N") == "N");
  CHECK(test::mdoc_argument("Op") == "\\&Op");
  CHECK(test::mdoc_argument("end") == "end");
  CHECK(test::mdoc_argument("") == "\\&");
  CHECK(test::mdoc_argument(".") == "\\&.");
  CHECK(test::mdoc_argument("two words") == "\"two words\"");
  CHECK(test::mdoc_argument("[NAME|PATTERN...]") == "[NAME|PATTERN...]");
  CHECK(test::mdoc_prose("One. Two (2.) three.") == "One.\nTwo (2.)\nthree.\n");
  CHECK(test::mdoc_prose(".profile is a file") == "\\&.profile is a file\n");
  CHECK(test::mdoc_prose("") == "");
  const std::vector<std::string> lines = {".x 'y'", "", "  z"};
  CHECK(test::mdoc_literal(lines) ==
        ".Bd -literal -offset indent\n\\&.x \\(aqy\\(aq\n\n  z\n.Ed\n");
  std::string words;
  for (int i = 0; i < 60; ++i) words += "word ";
  std::istringstream wrapped(test::mdoc_prose(words));
  for (std::string line; std::getline(wrapped, line);) CHECK(line.size() <= 78);
}

TEST_CASE("manual: commands, their options and every exit status are there") {
  const std::string page = read(manual / "spindle.1");
  const cli::Description description = cli::describe_grammar();
  for (const cli::CommandDescription& command : description.commands) {
    CAPTURE(command.name);
    CHECK(page.find("\n.Ss " + test::mdoc_argument(command.name)) != std::string::npos);
    for (const cli::OptionDescription& option : cli::left_to_manual(command)) {
      CHECK(page.find((option.is_argument() ? "Ar " : "Fl ") +
                      test::mdoc_argument(option.names.back().substr(
                          option.is_argument() ? 0 : 1))) != std::string::npos);
    }
  }
  for (const StatusInfo& status : status_table()) {
    CHECK(page.find(fmt::format("\n.It Sy {} {}\n", static_cast<int>(status.status),
                                test::mdoc_argument(status.name))) != std::string::npos);
  }
}

TEST_CASE("manual: an appendix is text and terms, a command below another has its own heading") {
  const cli::Description description{
      .commands = {{.name = "a",
                    .synopsis = "X",
                    .meaning = "does it",
                    .appendix =
                        [] {
                          return std::string(
                              "Words (of it):\n  one[=N]   the first\n  two\n\nAnd more.\n");
                        },
                    .commands = {{.name = "a b", .meaning = "below"}}}}};
  CHECK(test::manual_placeholders(description).front().text ==
        ".Ss a\n.Dl spindle a X\\&\n.Pp\nDoes it.\n.Pp\nWords (of it):\n.Pp\n.Bl -tag -width Ds "
        "-compact\n.It Cm one[=N]\nthe "
        "first\n.It Cm two\n.El\n.Pp\nAnd more.\n.Ss a b\n.Dl spindle a b\\&\n.Pp\nBelow.\n");
}

TEST_CASE("manual: every variable of the environment that is read is explained") {
  const std::string page = read(manual / "spindle.1");
  const auto names =
      found(sources("cli", ""), R"re((?:variable|xdg_folder)\(world, "([A-Z_]+)")re");
  CHECK(names.size() >= 8);
  for (const std::string& name : names) {
    CAPTURE(name);
    CHECK(explains(page, name));
  }
}

TEST_CASE("manual: every option of a URL is explained") {
  const std::string page = read(manual / "spindle.1");
  const auto names = found(sources("link", "endpoint"), R"re(\{"([a-z0-9]+)", [^"]*set_\w+\})re");
  CHECK(names.size() >= 4);
  for (const std::string& name : names) {
    CAPTURE(name);
    CHECK(page.find("\n.It Cm " + name + "\n") != std::string::npos);
  }
}

TEST_CASE("manual: every key of every kind of file is explained") {
  const std::pair<std::vector<files::KeyList>, const char*> kinds[] = {
      {files::profile_keys(), "spindle-profile.5"},
      {files::tools_keys(), "spindle-tools.5"},
      {files::backup_keys(), "spindle-backup.5"},
      {files::dump_keys(), "spindle-backup.5"}};
  for (const auto& [lists, name] : kinds) {
    // Of the list of keys itself there is no more than the keys.
    const std::string page = read(manual / (std::string(name) + ".in"));
    std::set<std::string> keys;
    for (const files::KeyList& list : lists) add_names(list.keys, keys);
    for (const std::string& key : keys) {
      CAPTURE(name);
      CAPTURE(key);
      CHECK(explains(page, key));
    }
  }
}

TEST_CASE("manual: every key of a profile has an example in a file that is right") {
  std::vector<std::string> without;
  test::key_placeholders(key_examples(), without);
  // The keys of a status are those of all models, and a command word has bits, not values.
  CHECK(fmt::format("{}", fmt::join(without, " ")) == "command-word.status.stopped");
  const fs::path good = root / "tests" / "profiles" / "good";
  const files::ProfileStore store({good.string(), (root / "profiles").string()},
                                  posix::source_disk());
  const auto findings = store.check((good / "every-key.yaml").string());
  REQUIRE(findings.has_value());
  CHECK(findings->empty());
}

TEST_CASE("manual: an example is the shortest, on one line, and YAML") {
  test::KeyExamples examples;
  examples.add(
      "link: {framing: tcp, port: 5000}\nparameters:\n"
      "  - {name: a, title: \"100 % of: it\", labels: {0: off, 1: on}}\n"
      "  - {name: b, title: \"A title that is longer than any line of a table can be, \" }\n"
      "---\npart: texts\nerror-codes: {1: one}\n");
  examples.add("link: {port: 502}\nrun: {model: start-action, start: {action: go}}\n");
  using test::KeyExamples;
  CHECK(KeyExamples::example(examples.maps("link"), "port") == "port: 502");
  CHECK(KeyExamples::example(examples.maps("link"), "unit").empty());
  CHECK(KeyExamples::example(examples.maps("parameters"), "title") == "title: \"100 % of: it\"");
  CHECK(KeyExamples::example(examples.maps("parameters"), "labels") == "labels: {0: off, 1: on}");
  CHECK(KeyExamples::example(examples.maps("texts"), "error-codes") == "error-codes: {1: one}");
  CHECK(KeyExamples::example(examples.maps("start-action"), "start") == "start: {action: go}");
  CHECK(KeyExamples::example(examples.maps("profile"), "parameters") ==
        "parameters: [{name: a, ...}, ...]");
}

TEST_CASE("manual: the words of a profile are explained") {
  const std::string page = read(manual / "spindle-profile.5");
  auto words = found(sources("files", "profile_"),
                     R"re(\{"([A-Za-z0-9.%-]+)", (?:"|true|false|'|\w+::|[A-Z]\w*::))re");
  const auto add = [&](const auto&... tables) {
    (..., [&](const std::vector<std::string>& more) {
      words.insert(more.begin(), more.end());
    }(tables.words()));
  };
  add(catalogue::evidence_words, catalogue::access_words, catalogue::kind_words,
      catalogue::hazard_words, catalogue::effect_words, catalogue::event_kind_words,
      catalogue::run_words, modbus::table_words, modbus::parity_words);
  CHECK(words.size() >= 40);
  for (const std::string& word : words) {
    CAPTURE(word);
    CHECK(explains(page, word));
  }
}

TEST_CASE("manual: the examples of files are valid") {
  const files::ProfileStore store({(root / "profiles").string()}, posix::source_disk());
  for (const char* name : {"my-driver.yaml", "any-device.yaml", "bm-line1.yaml"}) {
    CAPTURE(name);
    const auto findings = store.check((manual / "examples" / name).string());
    REQUIRE(findings.has_value());
    CHECK(findings->empty());
  }
  const auto tools =
      files::load_tools((manual / "examples" / "tools.yaml").string(), posix::source_disk());
  REQUIRE_MESSAGE(tools.has_value(), describe(tools.error()));
  CHECK(tools->tools.size() == 2);
}
