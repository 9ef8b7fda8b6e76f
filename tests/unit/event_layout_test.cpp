#include "spindle/catalogue/event_layout.hpp"

#include <doctest/doctest.h>

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
    CHECK(field.parameter->address.value == profile.events->first + field.at);
  }
}
