#include "files/fields.hpp"

#include <doctest/doctest.h>

#include <string>
#include <vector>

using namespace spindle;
using namespace spindle::files;

namespace {

enum class Colour : std::uint8_t { red, blue };
constexpr auto colour_words = enum_table<Colour>({{"red", Colour::red}, {"blue", Colour::blue}});

struct Flag {
  catalogue::Text name = {};
  Colour colour = Colour::red;
};

struct Paint {
  Colour colour = Colour::red;
};

struct Mast {
  std::uint8_t height = 0;
  std::uint16_t first = 0;
  std::uint16_t last = 0;
  Paint paint = {};
  std::optional<Colour> light = std::nullopt;
  std::optional<Flag> pennant = std::nullopt;
  catalogue::List<Flag> flags = {};
  std::string stay = {};
};

constexpr Field<Flag> flag_fields[] = {
    field<&Flag::name>("name", Need::inherited),
    word<colour_words, &Flag::colour>("colour"),
};

void read_stay(const YamlNode& node, Mast& mast, const Asked&) { mast.stay = "of " + node.text; }

constexpr Field<Mast> mast_fields[] = {
    field<&Mast::height>("height", Need::required).shared(),
    range<&Mast::first, &Mast::last>("numbers"),
    word<colour_words, &Mast::paint, &Paint::colour>("colour"),
    word<colour_words, &Mast::light>("light", Need::optional, "lamp"),
    map_of<flag_fields, &Mast::pennant>("pennant"),
    list_of<flag_fields, &Mast::flags>("flags"),
    custom("stay", Need::optional, "text", read_stay),
};

/// Reads a map into a mast that may be there already; what is wrong, one line each.
std::vector<std::string> read(const std::string& yaml, Mast& mast, const std::string& group = {}) {
  Diagnostics findings;
  const std::size_t file = findings.add_file("f");
  const auto documents = parse_yaml(yaml, file, Documents::all, findings);
  const auto groups = parse_yaml(group, file, Documents::all, findings);
  YamlMap map(documents.at(0), findings, groups.empty() ? nullptr : groups.data());
  read_fields(mast_fields, map, mast);
  map.finish();
  std::vector<std::string> lines;
  for (const Diagnostic& finding : findings.list()) lines.push_back(finding.to_string());
  return lines;
}

using Lines = std::vector<std::string>;

}  // namespace

TEST_CASE("fields: each row is read into its member") {
  Mast mast;
  CHECK(read("{height: 7, numbers: 2..3, colour: blue, light: blue, pennant: {name: P},\n"
             " flags: [{name: A}, {name: B, colour: blue}], stay: rope}",
             mast) == Lines());
  CHECK(mast.height == 7);
  CHECK(mast.first == 2);
  CHECK(mast.last == 3);
  CHECK(mast.paint.colour == Colour::blue);
  CHECK(mast.light == Colour::blue);
  CHECK(mast.pennant->name == "P");
  REQUIRE(mast.flags.size() == 2);
  CHECK(mast.flags[1].name == "B");
  CHECK(mast.flags[1].colour == Colour::blue);
  CHECK(mast.stay == "of rope");
}

TEST_CASE("fields: what is wrong is told where it stands, and changes nothing") {
  Mast mast{.height = 9, .light = Colour::blue};
  CHECK(read("{height: 256, numbers: 3..2, light: green, pennant: {}, stays: rope}", mast) ==
        Lines{"f:1:10: '256' is not a whole number from 0 to 255",
              "f:1:24: '3..2' is not a range such as 1..15, at most up to 65535",
              "f:1:37: unknown lamp 'green'; known: red, blue", "f:1:53: key 'name' is missing",
              "f:1:57: unknown key 'stays'; did you mean 'stay'?"});
  CHECK(mast.height == 9);
  CHECK(mast.last == 0);
  CHECK(mast.light == Colour::blue);
  CHECK(read("{numbers: 1..2}", mast) == Lines{"f:1:1: key 'height' is missing"});
}

TEST_CASE("fields: what a layer below says is not asked for again") {
  Mast mast{.pennant = Flag{.name = "P"}};
  CHECK(read("{height: 1, pennant: {colour: blue}}", mast) == Lines());
  CHECK(mast.pennant->name == "P");
  CHECK(mast.pennant->colour == Colour::blue);
}

TEST_CASE("fields: only what may be shared is taken from the group") {
  Mast mast;
  CHECK(read("{numbers: 4}", mast, "{height: 5, stay: rope}") == Lines());
  CHECK(mast.height == 5);
  CHECK(mast.stay.empty());
}

TEST_CASE("fields: a table tells its keys") {
  const std::vector<Key> keys = keys_of<mast_fields>();
  REQUIRE(keys.size() == 7);
  CHECK(keys[0].name == "height");
  CHECK(keys[0].need == Need::required);
  CHECK(keys[0].value == "number 0..255");
  CHECK(keys[1].value == "range 0..65535");
  CHECK(keys[2].words() == std::vector<std::string>{"red", "blue"});
  CHECK(keys[5].value == "list of maps");
  CHECK(keys[5].inner().at(1).name == "colour");
}
