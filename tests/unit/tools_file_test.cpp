#include "spindle/files/tools_file.hpp"

#include <doctest/doctest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "spindle/posix/disk.hpp"

using namespace spindle;
using files::load_tools;
using files::Tools;

namespace {

/// A tools file that lives as long as the object.
class ToolsFile {
 public:
  explicit ToolsFile(const std::string& text)
      : path_((std::filesystem::temp_directory_path() /
               ("spindle-tools-" + std::to_string(::getpid()) + ".yaml"))
                  .string()) {
    std::ofstream(path_) << text;
  }
  ToolsFile(const ToolsFile&) = delete;
  ToolsFile& operator=(const ToolsFile&) = delete;
  ~ToolsFile() { std::filesystem::remove(path_); }

  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  std::string path_;
};

/// What is wrong, without the file's name.
std::string fault(const std::string& text) {
  const ToolsFile file(text);
  const auto tools = load_tools(file.path(), posix::source_disk());
  if (tools) return "nothing";
  CHECK(tools.error().code == Errc::bad_file);
  REQUIRE(tools.error().message.starts_with(file.path() + ":"));
  return tools.error().message.substr(file.path().size() + 1);
}

}  // namespace

TEST_CASE("the example of the contract, section 2.1") {
  const ToolsFile file(
      "tools:\n"
      "  station3:  {url: \"tcp://192.168.10.23\", profile: doga-bmt, torque-unit: \"N.m\", "
      "verified: [start, select-preset]}\n"
      "  conveyor1: {url: \"rtu:///dev/ttyUSB0?unit=3&baud=115200\", profile: orientalmotor-blv}\n"
      "groups:\n"
      "  line1: [station3, conveyor1]\n");
  const auto tools = load_tools(file.path(), posix::source_disk());
  REQUIRE_MESSAGE(tools.has_value(), describe(tools.error()));
  CHECK(tools->path == file.path());
  REQUIRE(tools->tools.size() == 2);
  CHECK(tools->tools[0].name == "station3");
  CHECK(tools->tools[0].url == "tcp://192.168.10.23");
  CHECK(tools->tools[0].profile == "doga-bmt");
  CHECK(tools->tools[0].torque_unit == "N.m");
  CHECK(tools->tools[0].verified == std::vector<std::string>{"start", "select-preset"});
  CHECK(tools->tools[1].url == "rtu:///dev/ttyUSB0?unit=3&baud=115200");
  CHECK(tools->tools[1].torque_unit.empty());
  CHECK(tools->tools[1].verified.empty());
  REQUIRE(tools->groups.size() == 1);
  CHECK(tools->groups.at("line1") == std::vector<std::string>{"station3", "conveyor1"});
}

TEST_CASE("all torque units of the manual's family are known") {
  for (const char* unit : {"kgf.cm", "kgf.m", "N.m", "cN.m", "lbf.in", "ozf.in", "lbf.ft"}) {
    CAPTURE(unit);
    const ToolsFile file(std::string("tools: {a: {url: u, torque-unit: ") + unit + "}}\n");
    const auto tools = load_tools(file.path(), posix::source_disk());
    REQUIRE(tools.has_value());
    CHECK(tools->tools[0].torque_unit == unit);
  }
}

TEST_CASE("limits are those of joints, by preset") {
  const ToolsFile file("tools: {a: {url: u, limits: {1: \"2.44:2.98\", 12: \"1.4:\"}}}\n");
  const auto tools = load_tools(file.path(), posix::source_disk());
  REQUIRE_MESSAGE(tools.has_value(), describe(tools.error()));
  const auto& limits = tools->tools[0].limits;
  REQUIRE(limits.size() == 2);
  CHECK(limits.at(1).lower == Decimal(244, -2));
  CHECK(limits.at(1).upper == Decimal(298, -2));
  CHECK(limits.at(12).lower == Decimal(14, -1));
  CHECK_FALSE(limits.at(12).upper);
}

TEST_CASE("faults are told with their place") {
  struct Row {
    const char* text;
    const char* fault;
  };
  const std::vector<Row> rows = {
      {"", "1:1: the file is empty"},
      {"groups: {}\n", "1:1: key 'tools' is missing"},
      {"tools: {a: {url: x}}\ntoolz: {}\n", "2:1: unknown key 'toolz'; did you mean 'tools'?"},
      {"tools: [a]\n", "1:8: a mapping of keys to values is expected here, not a list"},
      {"tools:\n  a: {profile: x}\n", "2:6: key 'url' is missing"},
      {"tools:\n  a: {url: \"\"}\n", "2:12: key 'url' is empty"},
      {"tools:\n  a: {url: x, profil: y}\n", "2:15: unknown key 'profil'; did you mean 'profile'?"},
      {"tools:\n  a: {url: x}\n  a: {url: y}\n", "3:3: key 'a' is given twice"},
      {"tools:\n  a: {url: x, torque-unit: Nm}\n",
       "2:28: unknown torque unit 'Nm'; did you mean 'N.m'?"},
      {"tools:\n  a: {url: x, limits: {1: \"3:2\"}}\n",
       "2:27: '3:2' are no limits; write \"2.44:2.98\", or one of the two"},
      {"tools:\n  a: {url: x, limits: {one: \"2:3\"}}\n", "2:24: 'one' is no number of a preset"},
      {"tools:\n  a: {url: x, limits: \"2:3\"}\n",
       "2:23: a mapping of keys to values is expected here, not a single value"},
      {"tools:\n  a: {url: x, verified: start}\n",
       "2:25: a list is expected here, not a single value"},
      {"tools:\n  a: {url: x, verified: [start, start]}\n", "2:33: 'start' is given twice"},
      {"tools:\n  \"@a\": {url: x}\n", "2:3: name '@a' is not made of the letters"},
      {"tools:\n  -a: {url: x}\n", "2:3: name '-a' is not made of the letters"},
      {"tools: {a: {url: x}}\ngroups: {g: [a, b]}\n", "2:17: unknown tool 'b'; did you mean 'a'?"},
      {"tools: {a: {url: x}}\ngroups: {g: [a, a]}\n", "2:17: 'a' is given twice"},
      {"tools: {a: {url: x}}\ngroups: {g: []}\n", "2:13: group 'g' has no tools"},
      {"tools: {a: {url: x}}\ngroups: {g: a}\n",
       "2:13: a list is expected here, not a single value"},
      {"tools: {a: {url: x}}\ngroups: {g/h: [a]}\n", "2:10: name 'g/h' is not made of the letters"},
      {"tools:\n  a: {url: x, transaction: zero}\n",
       "2:28: unknown transaction 'zero'; known: echoed, ignored"},
      {"tools:\n  a: {url: x, transaction: ignore}\n",
       "2:28: unknown transaction 'ignore'; did you mean 'ignored'?"},
      {"tools: {a: {url: x}\n", "not valid YAML here: a '}' is missing"},
      {"tools: {a: {url: x}}\nsinks: {p: {}}\n", "2:12: key 'url' is missing"},
      {"tools: {a: {url: x}}\nsinks: {p: {url: \"http://h\"}}\n", "2:18: it is no URL of a sink"},
      {"tools: {a: {url: x}}\nsinks: {p: {url: [\"mqtt://h\", \"postgres://h/d\"]}}\n",
       "2:31: all URLs of a sink are of one kind"},
      {"tools: {a: {url: x}}\nsinks: {p: {url: []}}\n", "2:18: a sink needs a URL"},
      {"tools: {a: {url: x}}\nsinks: {p: {url: \"mqtt://u:w@h\"}}\n",
       "2:18: a password may not stand in a URL"},
      {"tools: {a: {url: x}}\nsinks: {p: {url: \"mqtt://h\", window: 0}}\n", "it is 1 at least"},
      {"tools: {a: {url: x}}\nsinks: {p: {url: \"mqtt://h\", batch: 5}}\n",
       "'batch' is about sinks of kind postgresql"},
      {"tools: {a: {url: x}}\nsinks: {p: {url: \"mqtt://h\", cert-file: c}}\n",
       "'cert-file' makes no sense without 'key-file'"},
      {"tools: {a: {url: x}}\nsinks: {p/q: {url: \"mqtt://h\"}}\n",
       "name 'p/q' is not made of the letters"},
      {"tools: {a: {url: x}}\n---\nmore: 1\n", "3:1: a second document has no meaning here"},
  };
  for (const Row& row : rows) {
    CAPTURE(row.text);
    const std::string found = fault(row.text);
    CAPTURE(found);
    CHECK(found.find(row.fault) != std::string::npos);
  }
}

TEST_CASE("sinks, with their files in the folder of the tools file") {
  const ToolsFile file(
      "tools: {a: {url: x}}\n"
      "sinks:\n"
      "  plant: {url: [\"mqtts://a/acme/line1\", \"mqtts://b\"], user: me, password-file: secret,\n"
      "          ca-file: /etc/ca.pem, events: all, window: 20}\n"
      "  base: {url: \"postgresql://host/db\", batch: 1000}\n");
  const auto tools = load_tools(file.path(), posix::source_disk());
  REQUIRE_MESSAGE(tools.has_value(), describe(tools.error()));
  REQUIRE(tools->sinks.size() == 2);
  const files::Sink& plant = tools->sinks[0];
  CHECK(plant.name == "plant");
  CHECK(plant.urls == std::vector<std::string>{"mqtts://a/acme/line1", "mqtts://b"});
  CHECK(plant.password_file ==
        (std::filesystem::path(file.path()).parent_path() / "secret").string());
  CHECK(plant.ca_file == "/etc/ca.pem");
  CHECK(plant.events == files::SinkEvents::all);
  CHECK(plant.window == 20U);
  CHECK(tools->sinks[1].batch == 1000U);
}

TEST_CASE("URLs of sinks") {
  struct Row {
    const char* url;
    const char* meant;  ///< "tls host port base", or the fault
  };
  const Row rows[] = {
      {"mqtt://h", "plain h 1883 spindle/v1"},
      {"mqtts://h/", "tls h 8883 spindle/v1"},
      {"mqtts://h:1234/acme/site 1/", "tls h 1234 acme/site 1"},
      {"mqtt://[::1]:1884/a%20b", "plain ::1 1884 a b"},
      {"mqtt://", "the host is missing"},
      {"mqtt://:1883/a", "the host is missing"},
      {"mqtt://h:0", "the port is none of 1 to 65535"},
      {"mqtt://h:65536", "the port is none of 1 to 65535"},
      {"mqtt://[::1", "a ']' is missing behind the address"},
      {"mqtt://h/$SYS/a", "the topic begins with '$'"},
      {"mqtt://h/a%2Bb", "the topic has a '+' or '#'"},
      {"mqtt://h/a%0Ab", "the topic has control characters, or is no UTF-8"},
      {"mqtt://h/a%2", "a '%' in the topic is not followed by two hexadecimal digits"},
      {"mqtt://h/a?b", "a URL of MQTT has no '?' and no '#'"},
      {"mqtt://me@h/a", "a user does not stand in the URL of a broker"},
      {"mqtt://me:pass@h/a", "a password may not stand in a URL"},
      {"postgresql://me:pass@h/a", "a password may not stand in a URL"},
      {"postgresql://h/a?pass%77ord=x", "a password may not stand in a URL"},
      {"ftp://h", "it is no URL of a sink"},
  };
  for (const Row& row : rows) {
    CAPTURE(row.url);
    const auto url = files::parse_sink_url(row.url);
    const std::string meant = url ? std::string(url->is_encrypted ? "tls " : "plain ") + url->host +
                                        " " + std::to_string(url->port) + " " + url->base
                                  : message_of(url.error());
    CHECK(meant == row.meant);
  }
  const auto database = files::parse_sink_url("postgresql://me@h/a?sslmode=verify-full");
  REQUIRE(database);
  CHECK(database->kind == files::SinkKind::postgresql);
}

TEST_CASE("a file that is not there") {
  const auto tools = load_tools("/no/such/spindle.yaml", posix::source_disk());
  REQUIRE_FALSE(tools.has_value());
  CHECK(describe(tools.error()) == "/no/such/spindle.yaml: no such file");
}
