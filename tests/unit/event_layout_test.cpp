#include "spindle/catalogue/event_layout.hpp"

#include <doctest/doctest.h>

#include <string>
#include <utility>
#include <vector>

#include "support/bm_profile.hpp"

using namespace spindle;
using catalogue::EventKind;

TEST_CASE("number and kind stand in the block where the profile says") {
  const catalogue::Profile profile = test::bm_profile();
  const catalogue::EventLayout layout(profile);
  Registers block(profile.events->count);
  block[0] = 1962;
  block[12] = 2;
  CHECK(layout.number_of(block) == 1962);
  CHECK(layout.kind_of(block) == EventKind::fastening_ng);
  block[12] = 9;
  CHECK(layout.kind_of(block) == std::nullopt);
}

TEST_CASE("a layout has the parameters of the block and no others") {
  const catalogue::Profile profile = test::bm_profile();
  const catalogue::EventLayout layout(profile);
  REQUIRE(!layout.fields().empty());
  for (const auto& field : layout.fields()) {
    CAPTURE(field.parameter->name);
    CHECK(field.parameter->name.starts_with("event."));
    CHECK(field.parameter->address.value == *profile.events->first + field.at);
  }
}

TEST_CASE("what stands behind the usual registers is known by the length of the block") {
  catalogue::Profile profile = test::bm_profile();
  std::vector<catalogue::Parameter> parameters(profile.parameters.begin(),
                                               profile.parameters.end());
  const auto add = [&](const char* name, std::uint16_t address) {
    catalogue::Parameter parameter;
    parameter.name = std::string(name);
    parameter.table = modbus::RegisterTable::input;
    parameter.address = {address};
    parameters.push_back(parameter);
  };
  add("event.barcode", 3214);
  add("event.plus.seating-torque", 3214);
  add("event.plus.barcode", 3218);
  profile.parameters = std::move(parameters);
  profile.events->longer = {{.count = 46, .parameters = "event.barcode"},
                            {.count = 50, .parameters = "event.plus.*", .firmware_from = 3000}};

  const catalogue::EventLayout layout(profile);
  const auto keys = [&](std::size_t size) {
    std::string all;
    for (const auto& field : layout.fields()) {
      const bool is_own = field.at >= profile.events->count;
      if (is_own && catalogue::EventLayout::has(field, Registers(size))) all += field.key + " ";
    }
    return all;
  };
  CHECK(keys(14).empty());
  CHECK(keys(46) == "barcode ");
  CHECK(keys(50) == "seating_torque barcode ");
  CHECK(profile.events->count_for(2999) == 14);
  CHECK(profile.events->count_for(3000) == 50);
  CHECK((profile.events->has_form(46) && !profile.events->has_form(47)));
  CHECK_FALSE(profile.find("event.plus.barcode").has_value());
}
