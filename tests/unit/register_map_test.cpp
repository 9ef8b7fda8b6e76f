#include "spindle/files/register_map.hpp"

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <random>

using namespace spindle;
using namespace spindle::files;
using modbus::RegisterTable;

namespace {

Result<RegisterMap> read(std::string_view text, Numbering numbering = Numbering::address) {
  return read_register_map(text, "map.csv", numbering);
}

std::string fault(std::string_view text) {
  const auto map = read(text);
  return map ? "" : map.error().message;
}

}  // namespace

TEST_CASE("columns in any order and case, separators, marks and line ends") {
  for (const std::string_view text :
       {"register,name,type\n7,speed,i16\n", "\xEF\xBB\xBFType;NAME;Register\r\nI16;Speed;7\r\n",
        "Name\tADDRESS\ttype\rspeed\t0x7\tint16", "name , register , type\n \"speed\" , 7 , i16",
        "other,register,name,type,register\n,7,speed,i16,9\n\n,,,,\n"}) {
    CAPTURE(text);
    const auto map = read(text);
    REQUIRE(map.has_value());
    REQUIRE(map->entries.size() == 1);
    CHECK(map->entries[0].name == "speed");
    CHECK(map->entries[0].address == 7);
    CHECK(map->entries[0].encoding == "i16");
    CHECK(map->entries[0].evidence == "inferred");
    CHECK(map->faulty == 0);
  }
}

TEST_CASE("words of other people for types and access") {
  const std::pair<const char*, const char*> types[] = {
      {"", "u16"},       {"WORD", "u16"},  {"Float32", "f32"}, {"FLOAT", "f32"},
      {"uint32", "u32"}, {"dint", "dint"}, {"bool", "bit"},    {"f64", "f64"}};
  for (const auto& [written, meant] : types) {
    const auto map = read(fmt::format("register,type\n1,{}\n", written));
    REQUIRE(map->entries.size() == 1);
    CHECK(map->entries[0].encoding == meant);
  }
  for (const char* word : {"r", "R", "ro", "RO", "Read", ""}) {
    CHECK_FALSE(read(fmt::format("register,access\n1,{}\n", word))->entries.at(0).is_writable);
  }
  for (const char* word : {"rw", "RW", "w", "WO", "R/W", "write"}) {
    CHECK(read(fmt::format("register,access\n1,{}\n", word))->entries.at(0).is_writable);
  }
}

TEST_CASE("texts and bcd have a length, coils are bits") {
  const auto map = read(
      "register,type,table,access\n1,string16,,\n2,BCD4,,\n3,text,,\n4,text0,,\n5,,coil,rw\n"
      "6,bool,discrete,\n7,u16,coil,\n8,bit,discrete,rw\n");
  REQUIRE(map->entries.size() == 4);
  CHECK(map->entries[0].encoding == "text");
  CHECK(map->entries[0].length == 16);
  CHECK(map->entries[1].encoding == "bcd");
  CHECK(map->entries[1].length == 4);
  CHECK(map->entries[2].encoding == "bit");
  CHECK(map->entries[2].is_writable);
  CHECK(map->entries[3].table == RegisterTable::discrete);
  CHECK(map->faulty == 4);
  const std::string text = render_profile("made", *map, "map.csv");
  CHECK(text.find("encoding: text, length: 16, ") != std::string::npos);
  CHECK(text.find("table: coil, register: 5, encoding: bit, ") != std::string::npos);
}

TEST_CASE("names are made, and made unique") {
  const auto map = read(
      "register,name,description\n1,,\"Motor  Speed (max.)\"\n2,,Motor speed max\n"
      "3,motor-speed-max-2,\n4,a.b,\n5,,\xC3\x84\xC3\x96\n6,.-.x..y-,\n7,motor-speed-max,\n");
  std::vector<std::string> names;
  for (const MapEntry& entry : map->entries) names.push_back(entry.name);
  CHECK(names == std::vector<std::string>{"motor-speed-max", "motor-speed-max-2",
                                          "motor-speed-max-2-2", "a.b", "register-5", "x.y",
                                          "motor-speed-max-3"});
  for (const std::string& name : names) CHECK(may_name_profile(name));
}

TEST_CASE("numbers of the Modicon style") {
  const auto map =
      read("register\n40001\n30010\n400001\n465536\n465537\n40000\n4001\n", Numbering::modicon);
  REQUIRE(map->entries.size() == 4);
  CHECK(map->entries[0].address == 0);
  CHECK(map->entries[0].table == RegisterTable::holding);
  CHECK(map->entries[1].address == 9);
  CHECK(map->entries[1].table == RegisterTable::input);
  CHECK(map->entries[3].address == 65535);
  CHECK(map->faulty == 3);
  CHECK(map->hint.empty());
  CHECK_FALSE(read("register\n40001\n")->hint.empty());
  CHECK_FALSE(read("register\n400001\n")->hint.empty());
  CHECK(read("register\n4001\n")->hint.empty());
}

TEST_CASE("a faulty row is told with its line, and left out") {
  const auto map = read("register,description\n1,\"two\nlines\"\nx,\n2,fine\n");
  REQUIRE(map->entries.size() == 2);
  REQUIRE(map->warnings.size() == 1);
  CHECK(map->warnings[0].line == 4);
  CHECK(map->entries[0].title == "two lines");
}

TEST_CASE("what is no table of registers") {
  CHECK(fault("") == "map.csv:1: the file is empty");
  CHECK(fault("\n\n;;\n") == "map.csv:1: the file is empty");
  CHECK(fault("name\nx\n") == "map.csv:1: no column is called 'register' or 'address'");
  CHECK(fault("register\n\"1\n2\n") == "map.csv:2: a quote has no end");
  CHECK(fault(std::string_view("register\n1\n\0\n", 13)) ==
        "map.csv:3: a NUL byte: this is no text");
  CHECK(fault("register,unit\n1,\xB0") == "map.csv:2: this is no UTF-8");
  std::string rows = "register\n";
  for (int row = 0; row < 100'000; ++row) rows += "1\n";
  CHECK(fault(rows) == "map.csv:5002: more than 5001 rows are too many");
  CHECK(fault("register\n" + std::string(200, ',')) == "map.csv:2: a row has 100 fields at most");
}

TEST_CASE("long lines are cut, not read for ever") {
  const std::string long_text(1'000'000, 'a');
  const auto map = read("register,name,description,type\n1," + long_text + "," + long_text + ",\n" +
                        long_text + ",b,,\n2,c,," + long_text + "\n");
  REQUIRE(map.has_value());
  REQUIRE(map->entries.size() == 1);
  CHECK(map->entries[0].name.size() == 60);
  CHECK(map->entries[0].title.size() == 200);
  REQUIRE(map->warnings.size() == 2);
  for (const MapWarning& warning : map->warnings) CHECK(warning.message.size() < 300);
}

TEST_CASE("garbage ends, and names what can be read") {
  std::mt19937 random(4712);
  constexpr std::string_view letters = "register,\"\n\r;\t0123 4x.-name\xC3\xA4";
  for (int round = 0; round < 3000; ++round) {
    std::string text = "register,name\n";
    for (std::size_t length = random() % 60; length > 0; --length) {
      text += letters[random() % letters.size()];
    }
    const auto map = read(text);
    if (!map) continue;
    for (const MapEntry& entry : map->entries) {
      if (!may_name_profile(entry.name)) FAIL(entry.name);
    }
  }
}
