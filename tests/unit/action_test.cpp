#include "spindle/work/action.hpp"

#include <doctest/doctest.h>

#include <string>

#include "support/edit_list.hpp"

using namespace spindle;

namespace {

catalogue::Action action_on(std::string name, std::uint16_t address) {
  catalogue::Action action;
  action.name = std::move(name);
  action.address = {address};
  action.minimum = 0;
  action.maximum = 9999;
  return action;
}

/// A secret in register 300 and the one behind it, and something open.
catalogue::Profile secretive() {
  catalogue::Profile profile;
  profile.id = "secretive";
  catalogue::Parameter pin;
  pin.name = "pin";
  pin.address = {300};
  pin.encoding.kind = catalogue::Kind::u32;
  pin.secrecy = catalogue::Secrecy::secret;
  test::append(profile.parameters, pin);
  profile.actions = {action_on("enter-pin", 301), action_on("select", 302)};
  return profile;
}

}  // namespace

TEST_CASE("what an action writes over a secret is not recorded") {
  const auto secret = work::parse_action("enter-pin=4711", secretive());
  REQUIRE(secret);
  CHECK(secret->value == 4711);
  CHECK_FALSE(work::logged(*secret).new_value.has_value());
  const auto open = work::parse_action("select=3", secretive());
  REQUIRE(open);
  CHECK(work::logged(*open).new_value == files::LoggedValue(Decimal(3)));
}
