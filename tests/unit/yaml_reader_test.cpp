#include "files/yaml_reader.hpp"

#include <doctest/doctest.h>

#include <string>
#include <string_view>
#include <vector>

using namespace spindle;
using namespace spindle::files;

namespace {

using namespace std::string_literals;

struct Parsed {
  std::vector<YamlNode> documents;
  std::vector<std::string> findings;
};

Parsed parse(std::string_view text, Documents wanted = Documents::all) {
  Diagnostics findings;
  const std::size_t file = findings.add_file("f");
  Parsed parsed{parse_yaml(text, file, wanted, findings), {}};
  for (const Diagnostic& finding : findings.list()) parsed.findings.push_back(finding.to_string());
  return parsed;
}

using Texts = std::vector<std::string>;

}  // namespace

TEST_CASE("scalars stay as they were written") {
  const Parsed parsed = parse("{a: 010, b: yes, c: 1e3, d: \"no\", e: 1.50, f: ~, g: }");
  REQUIRE(parsed.findings.empty());
  REQUIRE(parsed.documents.size() == 1);
  const YamlNode& map = parsed.documents[0];
  REQUIRE(map.kind == YamlNode::Kind::map);
  CHECK(map.find("a")->text == "010");
  CHECK(map.find("b")->text == "yes");
  CHECK(map.find("c")->text == "1e3");
  CHECK(map.find("d")->text == "no");
  CHECK(map.find("e")->text == "1.50");
  CHECK(map.find("f")->kind == YamlNode::Kind::nothing);
  CHECK(map.find("g")->kind == YamlNode::Kind::nothing);
  CHECK(map.find("h") == nullptr);
}

TEST_CASE("order and places are kept; lines and columns count from 1") {
  const Parsed parsed = parse("# first\nz: 1\na:\n  - {x: [2, 3]}\n");
  REQUIRE(parsed.documents.size() == 1);
  const YamlNode& map = parsed.documents[0];
  REQUIRE(map.entries.size() == 2);
  CHECK(map.entries[0].key == "z");
  CHECK(map.entries[0].key_at == SourceLocation{0, 2, 1});
  CHECK(map.entries[0].value.at == SourceLocation{0, 2, 4});
  const YamlNode& inner = map.entries[1].value.items.at(0);
  CHECK(inner.at == SourceLocation{0, 4, 5});
  CHECK(inner.find("x")->items.at(1).at == SourceLocation{0, 4, 13});
}

TEST_CASE("a byte order mark in front is no part of the text") {
  const Parsed parsed = parse("\xEF\xBB\xBF{a: 1}\n");
  REQUIRE(parsed.findings.empty());
  REQUIRE(parsed.documents.size() == 1);
  CHECK(parsed.documents[0].find("a") != nullptr);
}

TEST_CASE("columns count bytes, as compilers do") {
  const Parsed parsed = parse("{ä: §, b: 1, b: 2}");
  CHECK(parsed.findings == Texts{"f:1:16: key 'b' is given twice"});
}

TEST_CASE("documents: the first alone, or all") {
  const std::string text = "a: 1\n---\nb: 2\n---\nc: [\n";
  const Parsed first = parse(text, Documents::first);
  CHECK(first.documents.size() == 1);
  CHECK(first.findings.empty());  // what is behind is not even scanned
  const Parsed all = parse(text);
  CHECK(all.documents.size() == 2);
  CHECK(all.documents[1].find("b")->text == "2");
  CHECK(all.findings.size() == 1);
  for (const char* nothing : {"", "\n", "# only a remark\n", "---\n"}) {
    CAPTURE(nothing);
    CHECK(parse(nothing).documents.empty());
    CHECK(parse(nothing).findings.empty());
  }
}

TEST_CASE("what YAML allows and we do not") {
  struct Row {
    std::string text;
    std::string finding;
  };
  const std::vector<Row> rows = {
      {"a: 1\na: 2\n", "f:2:1: key 'a' is given twice"},
      {"m: {x: 1, y: 2, x: 3}\n", "f:1:17: key 'x' is given twice"},
      {"a: &x 1\n", "f:1:4: anchors are not supported; write the value out"},
      {"a: !number 1\n", "f:1:4: tags are not supported"},
      {"a: !!int 1\n", "f:1:4: tags are not supported"},
      {"a: !x [1]\n", "f:1:4: tags are not supported"},
      {"[a]: 1\n", "f:1:1: a key must be a plain word"},
      {"~: 1\n", "f:1:1: a key must be a plain word"},
      {"a: b\n\xFF\n", "f:2:1: not valid UTF-8"},
      {"a: \xC0\xAF\n", "f:1:4: not valid UTF-8"},      // overlong
      {"a: \xED\xA0\x80\n", "f:1:4: not valid UTF-8"},  // surrogate
      {"a: \xF4\x90\x80\x80\n", "f:1:4: not valid UTF-8"},
      {"a: \xE2\x82", "f:1:4: not valid UTF-8"},  // cut off
      {"a: x\0y\n"s, "f:1:5: a NUL byte; this is not a text file"},
      {std::string(33, '[') + std::string(33, ']'), "f:1:33: nested more than 32 levels deep"},
  };
  for (const Row& row : rows) {
    CAPTURE(row.finding);
    CHECK(parse(row.text).findings == Texts{row.finding});
  }
  CHECK(parse(std::string(32, '[') + std::string(32, ']')).findings.empty());
}

TEST_CASE("syntax errors are told in our words, at their place") {
  struct Row {
    const char* text;
    const char* finding;
  };
  const std::vector<Row> rows = {
      {"a: {b: 1\n", "a '}' is missing"},
      {"a: [1, 2\n", "a ']' is missing"},
      {"a: \"open\n", "a quoted text is never closed"},
      {"a: b: c\n", "a ':' where no key is"},
      {"a: 1\n  b: 2\n", "a ':' where no key is"},
      {"a: 'open", "a quoted text is never closed"},
      {"a: [\"open]\n\n", "a quoted text is never closed"},
      {"a:\n  - 1\n b: 2\n", "a line is indented differently"},
      {"a: ]\n", "a '}' or ']' that closes nothing"},
      {"a: \"\\q\"\n", "an unknown escape"},
      {"a: %b\n", "a character that cannot begin a value"},
      {"a:\n\t- b\n", "a tab in the indentation"},
      {"a: - b\n", "a '-' where no list is"},
      {"a: \"x\" y\n", "something behind a finished value"},
      {"a: b\nc\n", "a line that is neither 'key: value' nor part of a text"},
      {"a: \"\\xZZ\"\n", "an escape without its digits"},
      {"a: \"\\ud800\"\n", "an escape that is no character"},
      {"a: \x01\n", "a character that YAML does not allow"},
      {"a: @b\n", "a character that cannot begin a value"},
  };
  for (const Row& row : rows) {
    CAPTURE(std::string(row.text));
    const Parsed parsed = parse(row.text);
    REQUIRE(parsed.findings.size() == 1);
    CAPTURE(parsed.findings[0]);
    CHECK(parsed.findings[0].find("not valid YAML here: ") != std::string::npos);
    CHECK(parsed.findings[0].find(row.finding) != std::string::npos);
  }
}

TEST_CASE("a comma behind a finished value ends the reading") {
  constexpr const char* stray = "a ',' outside of '[ ]' and '{ }'; quote the text";
  constexpr const char* closing = "a '}' or ']' that closes nothing";
  const std::vector<std::pair<std::string, std::string>> rows = {
      {" ,x]a,x]", "f:1:2: not valid YAML here: "s + stray},
      {",", "f:1:1: not valid YAML here: "s + stray},
      {"{\"a\": 1},\n", "f:1:9: not valid YAML here: "s + stray},
      {"[1, 2],\n[3]\n", "f:1:7: not valid YAML here: "s + stray},
      {"\"a\",\"b\"\n\"c\",\"d\"\n", "f:1:4: not valid YAML here: "s + stray},
      {"a: \"b\", c\n", "f:1:7: not valid YAML here: "s + stray},
      {"[1]]", "f:1:4: not valid YAML here: "s + closing},
  };
  for (const auto& [text, finding] : rows) {
    CAPTURE(text);
    for (const Documents wanted : {Documents::all, Documents::first}) {
      CHECK(parse(text, wanted).findings == Texts{finding});
    }
  }
  CHECK(parse("{\"a\": [1, 2,],}\n").findings.empty());
}

TEST_CASE("no text takes more than a bounded tree") {
  const auto repeated = [](std::string_view part, std::size_t bytes) {
    std::string text;
    while (text.size() + part.size() <= bytes) text += part;
    return text;
  };
  constexpr std::size_t most = std::size_t{1} << 20;
  for (const std::string_view part :
       {"[",    "{",        "- ",           "? ",           "[a,",   "{a: ",  "a,",    "- a\n",
        "[]\n", "---\n",    "&a ",          "!a ",          "*a ",   "\"",    "'",     "|\n",
        ">\n",  "a: b\n",   "%a\n",         "%TAG !a! b\n", "\n",    " ",     "\t",    "#",
        ": ",   "\xC2\x85", "\xE2\x80\xA8", "\xEF\xBB\xBF", "a\n\n", "[a]: ", "\"\\\n"}) {
    CAPTURE(part);
    const Parsed parsed = parse(repeated(part, most));
    CHECK(parsed.findings.size() <= 1000);
    std::size_t nodes = parsed.documents.size();
    for (const YamlNode& document : parsed.documents) {
      nodes += document.items.size() + document.entries.size();
    }
    CHECK(nodes <= 200'000);
  }
  CHECK(parse(repeated("a", most + 1)).findings == Texts{"f:1:1: larger than 1048576 bytes"});
  CHECK(parse("[" + repeated("a,", 300'000) + "]").findings ==
        Texts{"f:1:200000: more than 100000 values; this is no file of spindle's"});
  CHECK(parse("%TAG !a! b\n---\na: 1\n").findings == Texts{"f:1:1: tags are not supported"});
  CHECK(parse("%YAML 1.2\n---\na: %TAG\n").documents.size() == 0);
}

TEST_CASE("findings: sorted by place, the same fault once") {
  Diagnostics findings;
  const std::size_t file = findings.add_file("f");
  const std::size_t other = findings.add_file("g");
  findings.add({other, 1, 1}, "last");
  findings.add({file, 2, 1}, "second");
  findings.add({file, 2, 1}, "second");
  findings.add({file, 2, 1}, "third");
  findings.add_once({file, 2, 1}, "dropped");
  findings.add({file, 1, 9}, "first");
  Texts texts;
  for (const Diagnostic& finding : findings.list()) texts.push_back(finding.to_string());
  CHECK(texts == Texts{"f:1:9: first", "f:2:1: second", "f:2:1: third", "g:1:1: last"});
  CHECK(findings.error().code == Errc::bad_file);
  CHECK(findings.error().message == "f:1:9: first (and 3 more faults)");
}
