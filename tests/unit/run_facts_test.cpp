#include "spindle/catalogue/run_facts.hpp"

#include <doctest/doctest.h>

#include <cstdint>

#include "support/edit_list.hpp"

using namespace spindle;

TEST_CASE("operation data are selected by adjoining bits of the word") {
  catalogue::CommandWordSpec run;
  run.select = 0x07;
  CHECK(run.selecting(0) == 0);
  CHECK(run.selecting(2) == 2);
  CHECK(run.selecting(7) == 7);
  run.select = 0x70;
  CHECK(run.selecting(5) == 0x50);
}

TEST_CASE("a pattern of names gets its number") {
  CHECK(catalogue::numbered_name("operation.{n}.speed", 3) == "operation.3.speed");
  CHECK(catalogue::numbered_name("speed", 3) == "speed");
}

namespace {

catalogue::InputSpec some_inputs() {
  catalogue::InputSpec inputs{.parameter = "in.{n}", .first = 0, .last = 15, .functions = {}};
  test::append(inputs.functions, {.number = 0, .bit = std::nullopt});
  test::append(inputs.functions, {.number = 1, .bit = 3});
  test::append(inputs.functions, {.number = 2, .bit = 4});
  test::append(inputs.functions, {.number = 19, .bit = 5});
  return inputs;
}

}  // namespace

TEST_CASE("bits that are fixed are those of the profile") {
  const catalogue::CommandBits bits;
  CHECK(bits.word(0x2A) == 0x2A);
  CHECK(bits.standard(0xFFFF) == 0xFFFF);
  CHECK(bits.any_of(0x18) == 0x18);
  CHECK(bits.unknown() == 0);
}

TEST_CASE("a word is made of the bits that have its functions on this driver") {
  const std::int64_t numbers[] = {19, 0, 1, 0, 2, 0, 77, 1};
  const catalogue::CommandBits bits(some_inputs(), numbers);
  CHECK(bits.word(0x08) == 0x04);  // one of the two bits that have it
  CHECK(bits.word(0x28) == 0x05);
  CHECK(bits.word(0x30) == 0x11);
  CHECK(bits.word(0x00) == 0x00);
  CHECK_FALSE(bits.word(0x29).has_value());  // no bit has the function of bit 0
  CHECK(bits.standard(0x04) == 0x08);
  CHECK(bits.standard(0x84) == 0x08);
  CHECK(bits.standard(0x2B) == 0x20);  // bits 1 and 5 do nothing
  CHECK_FALSE(bits.standard(0x40).has_value());
  CHECK(bits.unknown() == 0xFF40);  // what was not read is unknown, too
  CHECK(bits.any_of(0x08) == 0xFFC4);
}
