#include <doctest/doctest.h>

#include <map>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "spindle/catalogue/list.hpp"
#include "spindle/catalogue/profile.hpp"
#include "spindle/catalogue/text.hpp"

using namespace spindle;
using namespace spindle::catalogue;

namespace {

// What a profile of the program looks like: nothing is filled at the start or freed at the end.
constexpr Label labels[] = {{0, "off"}, {1, "on"}};  // NOLINT(*-avoid-c-arrays)
constexpr Parameter parameters[] = {                 // NOLINT(*-avoid-c-arrays)
    {.name = "speed", .title = "Speed", .unit = "rpm", .source = "manual", .note = ""},
    {.name = "mode", .title = "Mode", .unit = "", .labels = labels, .source = "", .note = ""}};
constexpr Entry<unsigned, Text> models[] = {{3, "3204"}, {12, "3300"}};  // NOLINT(*-avoid-c-arrays)
constexpr IdentitySpec identity{.products = {}, .models = models};
constexpr EventSpec events{.number = "speed", .kind = "mode"};

constexpr Profile profile{.id = "constant",
                          .title = "Constant",
                          .maker = "",
                          .series = "",
                          .path = "",
                          .link = {},
                          .identity = identity,
                          .events = events,
                          .limits = std::nullopt,
                          .numbered = std::nullopt,
                          .parameters = parameters,
                          .actions = {},
                          .exceptions = {}};

static_assert(profile.parameters.size() == 2);
static_assert(profile.parameters[1].labels[1].text == "on");

std::string long_text() { return std::string(100, 'x'); }

}  // namespace

TEST_CASE("a constant profile is used as one that was read") {
  CHECK(profile.find("mode").value().labels.front().text == "off");
  CHECK(profile.find("sped").error().hint == "did you mean 'speed'?");
  REQUIRE(profile.identity->models.find(12) != nullptr);
  CHECK(*profile.identity->models.find(12) == "3300");
  CHECK(profile.identity->models.find(4) == nullptr);
  CHECK_THROWS_AS(static_cast<void>(profile.identity->models.at(4)), std::out_of_range);
}

TEST_CASE("a text outlives the string that it was made from, and every copy of itself") {
  Text copy;
  {
    std::string made = long_text();
    const Text text{std::string_view(made)};
    made.assign(made.size(), 'y');
    copy = text;
    const Text another = copy;  // NOLINT(performance-unnecessary-copy-initialization)
    CHECK(another == long_text());
  }
  CHECK(copy == long_text());
  const Text& same = copy;
  copy = same;
  CHECK(copy == long_text());
  copy = "literal";
  CHECK(copy == "literal");
}

TEST_CASE("what was moved away leaves an empty text, list and table") {
  Text text = long_text();
  const Text taken = std::move(text);
  CHECK(taken == long_text());
  CHECK(text.empty());  // NOLINT(bugprone-use-after-move): it is what is promised

  List<Text> list = {long_text(), "b"};
  const List<Text> all = std::move(list);
  CHECK(all.size() == 2);
  CHECK(list.empty());  // NOLINT(bugprone-use-after-move)
  CHECK(list.begin() == list.end());
}

TEST_CASE("a list keeps what it was made from, though the profile that held it is gone") {
  List<Parameter> kept;
  {
    Profile gone;
    Parameter made;
    made.name = long_text();
    made.labels = {{5, long_text()}};
    gone.parameters = {made, made};
    kept = gone.parameters;
  }
  CHECK(kept[1].name == long_text());
  CHECK(kept[1].labels.front().text == long_text());
}

TEST_CASE("a table is sorted by its keys and can be changed by way of a map") {
  Table<int, Text> table = {{7, Text("seven")}, {-1, Text("minus one")}, {3, Text("three")}};
  CHECK(table.begin()->key == -1);
  CHECK(table.at(3) == "three");
  auto map = table.to_map();
  map.insert_or_assign(3, Text("drei"));
  table = std::move(map);
  CHECK(table.at(3) == "drei");
  CHECK(table.size() == 3);
  CHECK_FALSE(table.contains(4));
}

TEST_CASE("texts compare and join as strings do") {
  const Text a = "a";
  const Text b = std::string("b");
  CHECK(a < b);
  CHECK(a != b);
  CHECK(std::string("a") == a);
  CHECK(std::string_view("b") == b);
  CHECK("x" + a == "xa");
  CHECK(a + "." + "c" == "a.c");
}
