#include "spindle/base/text.hpp"

#include <doctest/doctest.h>

using namespace spindle;

TEST_CASE("the article is the one that is spoken") {
  CHECK(with_article("BLV") == "a BLV");
  CHECK(with_article("BM") == "a BM");
  CHECK(with_article("K-Ducer") == "a K-Ducer");
  CHECK(with_article("code 30") == "a code 30");
  CHECK(with_article("profile doga-bm") == "a profile doga-bm");
  CHECK(with_article("FC01") == "an FC01");
  CHECK(with_article("SDM72D-M") == "an SDM72D-M");
  CHECK(with_article("Altivar") == "an Altivar");
  CHECK(with_article("Sinamics") == "a Sinamics");
  CHECK(with_article("X") == "an X");
}

TEST_CASE("a pattern matches the whole name") {
  struct Case {
    std::string_view pattern;
    std::string_view text;
    bool matches;
  };
  for (const auto& row : {
           Case{"", "", true},
           Case{"", "a", false},
           Case{"a", "", false},
           Case{"*", "", true},
           Case{"**", "abc", true},
           Case{"?", "", false},
           Case{"?", "a", true},
           Case{"a?c", "abc", true},
           Case{"preset.1.*torque*", "preset.1.target-torque", true},
           Case{"preset.1.*torque*", "preset.1.torque-limit", true},
           Case{"preset.1.*torque*", "preset.11.torque-limit", false},
           Case{"preset.*.speed", "preset.3.free-speed", false},
           Case{"preset.*.speed", "preset.15.speed", true},
           Case{"*.speed", "a.speed.speed", true},
           Case{"a*b*c", "a-b-b-c", true},
           Case{"a*b*c", "a-c-b", false},
           Case{"p[1-3]", "p2", true},
           Case{"p[1-3]", "p4", false},
           Case{"p[13]", "p2", false},
           Case{"p[!13]", "p2", true},
           Case{"p[!1-3]", "p2", false},
           Case{"*[0-9]", "alarm.1", true},
           Case{"*[ab]*[cd]", "xaxbxd", true},
           Case{"[]]", "]", true},
           Case{"[!]]", "]", false},
           Case{"[a-]", "-", true},
           Case{"[a*", "[a-z", true},
           Case{"[", "[", true},
           Case{"[]", "[]", true},
           Case{"[!]", "[!]", true},
           Case{"[z-a]", "m", false},
           Case{"A", "a", false},
       }) {
    const auto& [pattern, text, matches] = row;
    CAPTURE(row.pattern);
    CAPTURE(row.text);
    CHECK(glob_match(pattern, text) == matches);
  }
}

TEST_CASE("many stars do not take exponential time") {
  const std::string text(5000, 'a');
  std::string pattern;
  for (int star = 0; star < 50; ++star) pattern += "*a";
  CHECK(glob_match(pattern, text));
  CHECK_FALSE(glob_match(pattern + "b", text));
}

TEST_CASE("special characters make a pattern") {
  CHECK(is_pattern("*"));
  CHECK(is_pattern("preset.?"));
  CHECK(is_pattern("p[12]"));
  CHECK_FALSE(is_pattern("preset.1.target-torque"));
  CHECK_FALSE(is_pattern(""));
}

TEST_CASE("a misspelt word finds its neighbour") {
  const std::vector<std::string> commands = {"identify", "list",   "get",    "set",
                                             "watch",    "backup", "restore"};
  struct Case {
    std::string_view word;
    std::string_view nearest;  // empty: none
  };
  for (const auto& row : {
           Case{"identfy", "identify"},
           Case{"idnetify", "identify"},  // a swap counts once
           Case{"identifiy", "identify"},
           Case{"bakcup", "backup"},
           Case{"restoer", "restore"},
           Case{"gets", "get"},
           Case{"wach", "watch"},
           Case{"et", "get"},  // get and set are equally near: the first
           Case{"wacth", "watch"},
           Case{"wxxch", ""},  // two of five letters are too many
           Case{"zzzzzz", ""},
           Case{"x", ""},
           Case{"", ""},
       }) {
    const auto& [word, nearest] = row;
    CAPTURE(row.word);
    CHECK(closest(word, commands).value_or("") == nearest);
    const std::string sentence =
        nearest.empty() ? "" : "did you mean '" + std::string(nearest) + "'?";
    CHECK(suggestion(word, commands) == sentence);
  }
  CHECK_FALSE(closest("word", {}));
}

TEST_CASE("a misspelt dotted name is compared behind the head that both share") {
  const std::vector<std::string> names = {"preset.1.mode", "preset.1.target-torque",
                                          "preset.1.torque-limit", "preset.2.mode"};
  CHECK(closest("preset.1.mdoe", names) == "preset.1.mode");
  CHECK(closest("preset.1.torqe", names) == "preset.1.target-torque");
  CHECK(closest("preset.1.limti", names) == "preset.1.torque-limit");
  CHECK(closest("prest.2.mode", names) == "preset.2.mode");
  CHECK_FALSE(closest("preset.1.wxyz", names));
}

TEST_CASE("a name with other numbers is another thing, and is not proposed") {
  CHECK_FALSE(closest("operation.8.speed", {"operation.0.speed", "operation.7.speed"}));
  CHECK_FALSE(closest("conveyor3", {"conveyor1", "conveyor2"}));
  CHECK_FALSE(closest("u15", {"u16", "i16"}));
  CHECK_FALSE(closest("4-wire", {"2-wire", "3-wire"}));
  CHECK(closest("staton1", {"station1"}) == "station1");
  CHECK(closest("preset.1.sped", {"preset.2.speed", "preset.1.speed"}) == "preset.1.speed");
}

TEST_CASE("where nearly the same word means something else, only its spelling is mended") {
  const std::vector<std::string> units = {"N.m", "kgf.cm", "lbf.in"};
  CHECK(same_word("Nm", units) == "did you mean 'N.m'?");
  CHECK(same_word("KGF-CM", units) == "did you mean 'kgf.cm'?");
  for (const char* other : {"cN.m", "kgf.m", "lbf.ft", ""}) CHECK(same_word(other, units).empty());
  CHECK(same_word("U16", {"i16", "u16"}) == "did you mean 'u16'?");
  CHECK(same_word("rmp", {"rpm"}) == "did you mean 'rpm'?");
  CHECK(same_word("f32", {"i32", "u32"}).empty());
}

TEST_CASE("a command in a message can be pasted: it has one level of quotes") {
  CHECK(shown_command("spindle restore station1 a.yaml") == "'spindle restore station1 a.yaml'");
  CHECK(shown_command("spindle restore " + shell_word("tcp://h?unit=1") + " a.yaml") ==
        "spindle restore 'tcp://h?unit=1' a.yaml");
}

TEST_CASE("unsigned numbers are read completely or not at all") {
  struct Case {
    std::string_view text;
    std::optional<std::uint64_t> number;
  };
  for (const auto& row : {
           Case{"0", 0},
           Case{"42", 42},
           Case{"010", 10},
           Case{"0x10", 16},
           Case{"0xFfFf", 65535},
           Case{"65535", 65535},
           Case{"65536", std::nullopt},
           Case{"0x10000", std::nullopt},
           Case{"99999999999999999999999", std::nullopt},
           Case{"", std::nullopt},
           Case{"0x", std::nullopt},
           Case{"-1", std::nullopt},
           Case{"+1", std::nullopt},
           Case{" 1", std::nullopt},
           Case{"1 ", std::nullopt},
           Case{"1a", std::nullopt},
           Case{"0x-1", std::nullopt},
           Case{"0x0x1", std::nullopt},
       }) {
    const auto& [text, number] = row;
    CAPTURE(row.text);
    CHECK(parse_unsigned(text, 0xFFFF) == number);
  }
  CHECK(parse_unsigned("18446744073709551615", UINT64_MAX) == UINT64_MAX);
  CHECK_FALSE(parse_unsigned("18446744073709551616", UINT64_MAX));
}

TEST_CASE("splitting keeps empty parts") {
  using Parts = std::vector<std::string_view>;
  CHECK(split("a,b,c", ',') == Parts{"a", "b", "c"});
  CHECK(split("a", ',') == Parts{"a"});
  CHECK(split("", ',') == Parts{""});
  CHECK(split(",a,", ',') == Parts{"", "a", ""});
}

TEST_CASE("a word of a command line is quoted where a shell would read it otherwise") {
  CHECK(spindle::shell_word("tcp://10.0.0.7:5000") == "tcp://10.0.0.7:5000");
  CHECK(spindle::shell_word("my tool") == "'my tool'");
  CHECK(spindle::shell_word("preset.*") == "'preset.*'");
  CHECK(spindle::shell_word("it's") == "'it'\\''s'");
  CHECK(spindle::shell_word("") == "''");
}
