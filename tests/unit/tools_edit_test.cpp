#include "spindle/files/tools_edit.hpp"

#include <doctest/doctest.h>

#include <string>
#include <vector>

#include "spindle/files/tools_file.hpp"

using namespace spindle;
using files::NewTool;

namespace {

const NewTool station5 = {
    .name = "station5", .url = "tcp://192.168.10.25", .profile = "doga-bm", .serial = "1021100042"};
constexpr const char* line5 =
    "station5: {url: \"tcp://192.168.10.25\", profile: doga-bm, serial: \"1021100042\"}";

std::string added(const std::string& text, const NewTool& tool = station5) {
  const auto now = files::with_tool(text, tool, "spindle.yaml");
  return now ? *now : "error: " + describe(now.error());
}

/// A text in which `+` is where the new line is.
void check_place(std::string text) {
  CAPTURE(text);
  const std::size_t at = text.find('+');
  REQUIRE(at != std::string::npos);
  std::string before = text;
  const std::size_t begin = before.rfind('\n', at) + 1;
  before.erase(begin, before.find('\n', at) + 1 - begin);
  text.replace(at, 1, line5);
  CHECK(added(before) == text);
}

}  // namespace

TEST_CASE("a tool is added behind the last one, and all else stays as it was written") {
  check_place("tools:\n  a: {url: x}\n  +\n");
  check_place("tools:\n  a: {url: x}\n  +\ngroups:\n  g: [a]\n");
  check_place(
      "# ours\ntools:\n\n  a:   {url: x}   # the first\n  # b: {url: y}\n  +\n\n# groups\n"
      "groups: {g: [a]}\n");
  check_place(
      "groups:\n  g: [a]\ntools:\n    b: {url: y}\n    a:\n      url: x\n      verified:\n"
      "        - start\n    +\n");
  check_place(
      "tools:\n  a: {url: x,\n      verified: [start,\n      stop]\n    }\n  +\nsinks: {}\n");
  check_place("tools:\n  a: {url: x, verified: [\nstart\n]}\n  +\ngroups: {g: [a]}\n");
  check_place("---\ntools:\n  a: {url: x}\n  +\n");
  check_place("tools:  # all of them\n  +\n");
  check_place("tools:\n  +\n#  a: {url: x}\n\n#groups:\n#  g: [a]\n");
}

TEST_CASE("the first tool of a file, and of none") {
  CHECK(added("") == std::string("tools:\n  ") + line5 + "\n");
  CHECK(added("# nothing yet\n") == std::string("# nothing yet\ntools:\n  ") + line5 + "\n");
  CHECK(added("tools: {}\n") == std::string("tools:\n  ") + line5 + "\n");
  CHECK(added("tools: { }  # none\ngroups: {}\n") ==
        std::string("tools:  # none\n  ") + line5 + "\ngroups: {}\n");
  CHECK(added("tools:\n  a: {url: x}") == std::string("tools:\n  a: {url: x}\n  ") + line5 + "\n");
}

TEST_CASE("line ends stay what they are") {
  CHECK(added("tools:\r\n  a: {url: x}\r\ngroups:\r\n  g: [a]\r\n") ==
        std::string("tools:\r\n  a: {url: x}\r\n  ") + line5 + "\r\ngroups:\r\n  g: [a]\r\n");
}

TEST_CASE("the file to begin with takes a tool") {
  const std::string empty = files::empty_tools_file();
  const auto read = files::parse_tools(empty, "spindle.yaml");
  REQUIRE_MESSAGE(read.has_value(), describe(read.error()));
  CHECK(read->tools.empty());
  const auto now = files::parse_tools(added(empty), "spindle.yaml");
  REQUIRE_MESSAGE(now.has_value(), describe(now.error()));
  REQUIRE(now->tools.size() == 1);
  CHECK(now->tools.front().name == "station5");
  CHECK(now->tools.front().serial == "1021100042");
}

TEST_CASE("what cannot be added is refused, with a line to add by hand") {
  struct Row {
    const char* text;
    const char* error;
  };
  const std::vector<Row> rows = {
      {"tools: {a: {url: x}}\n", "it is written so that no line can be added"},
      {"{tools: {}}\n", "it is written so that no line can be added"},
      {"[a]\n", "this is no tools file"},
      {"tools:\n  a: {url: x}\n---\ntools: {}\n", "this is no tools file"},
  };
  for (const Row& row : rows) {
    CAPTURE(row.text);
    const auto now = files::with_tool(row.text, station5, "spindle.yaml");
    REQUIRE_FALSE(now);
    CHECK(now.error().code == Errc::bad_file);
    CHECK(now.error().message.find(row.error) != std::string::npos);
    CHECK(now.error().hint.find(line5) != std::string::npos);
  }
  CHECK(added("tools:\n  a: {url: x\n").starts_with("error: spindle.yaml:"));
  CHECK(added("tools: [a]\n").starts_with("error: spindle.yaml:1:8"));
  CHECK(added("tools:\n  a: {url: x}\nfoo: 1\n").starts_with("error: spindle.yaml:3:1"));
}

TEST_CASE("a name is taken once, also by an entry with a fault") {
  const std::string text = "tools:\n  station4: {url: x}\n  station5: {urll: y}\n";
  const auto now = files::with_tool(text, station5, "spindle.yaml");
  REQUIRE_FALSE(now);
  CHECK(now.error().code == Errc::usage);
  CHECK(now.error().message == "a tool of this name is there already: spindle.yaml:3");
  NewTool other = station5;
  other.name = "station6";
  CHECK(added(text, other).starts_with(text));
}

TEST_CASE("names and values that no entry can have are refused before anything is written") {
  for (const char* name : {"", "@line", "-x", "a b", "a:", "tcp://x", "/dev/ttyUSB0", "a\nb"}) {
    CAPTURE(name);
    NewTool tool = station5;
    tool.name = name;
    const auto now = files::with_tool("tools: {}\n", tool, "spindle.yaml");
    REQUIRE_FALSE(now);
    CHECK(now.error().code == Errc::usage);
  }
  NewTool tool = station5;
  tool.torque_unit = "Nm";
  const auto now = files::with_tool("tools: {}\n", tool, "spindle.yaml");
  REQUIRE_FALSE(now);
  CHECK(now.error().code == Errc::usage);
  CHECK(describe(now.error()) == "station5: unknown torque unit 'Nm'; did you mean 'N.m'?");
  tool.torque_unit = {};
  tool.url = "sim:\"x\\\ty\"";  // no text can end its own quotes
  const auto read = files::parse_tools(added("tools: {}\n", tool), "spindle.yaml");
  REQUIRE(read.has_value());
  CHECK(read->tools.front().url == tool.url);
}
