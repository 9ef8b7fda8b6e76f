#include "spindle/catalogue/run_facts.hpp"

#include <doctest/doctest.h>

using namespace spindle;

TEST_CASE("operation data are selected by adjoining bits of the word") {
  catalogue::RunFacts run;
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
