#include "spindle/catalogue/short_name.hpp"

#include <doctest/doctest.h>

#include <string>
#include <vector>

#include "support/rig.hpp"

using namespace spindle;
using namespace spindle::catalogue;

namespace {

std::string read(std::string_view typed) {
  const auto meant = meant_by(typed, test::product("doga-bm").profile);
  return meant ? *meant : "! " + message_of(meant.error());
}

std::string written(std::string_view typed) {
  const auto meant = one_meant_by(typed, test::product("doga-bm").profile);
  return meant ? *meant : "! " + message_of(meant.error());
}

}  // namespace

TEST_CASE("the ending of one name is that name") {
  CHECK(read("1.target-torque") == "preset.1.target-torque");
  CHECK(written("1.target-torque") == "preset.1.target-torque");
  CHECK(read("target-torqu") == "target-torqu");  // ends at no point
}

TEST_CASE("the beginning of names is all of them for what reads, and refused for what writes") {
  CHECK(read("preset.1") == "preset.1.*");
  CHECK(written("preset.1").starts_with("! it may mean "));
}

TEST_CASE(
    "an ending of several names is an error with all of them, and a command that shows them") {
  const auto meant = meant_by("target-torque", test::product("doga-bm").profile);
  REQUIRE_FALSE(meant.has_value());
  const Error& error = meant.error();
  CHECK(error.code == Errc::unknown_name);
  CHECK(error.name == "target-torque");
  REQUIRE(error.details.size() == 1);
  CHECK(error.details.front().find("preset.1.target-torque, preset.2.target-torque") !=
        std::string::npos);
  CHECK(error.remedy.right == "spindle get TARGET '*.target-torque'");
}

TEST_CASE("whole names, patterns, numbers, registers and unknown names are what they are") {
  for (const std::string name :
       {"preset.1.target-torque", "preset.*", "p2", "@holding:2", "nope", ""}) {
    CAPTURE(name);
    CHECK(read(name) == name);
    CHECK(written(name) == name);
  }
}

TEST_CASE("whether a word means any parameter") {
  const Profile profile = test::product("doga-bm").profile;
  CHECK(is_meant("speed", profile));
  CHECK(is_meant("p2", profile));
  CHECK_FALSE(is_meant("station3", profile));
}
