#include "spindle/base/interrupt.hpp"

#include <doctest/doctest.h>

using namespace spindle;

TEST_CASE("an interrupt is silent until it is raised") {
  Interrupt interrupt;
  CHECK_FALSE(interrupt.raised());
  CHECK(interrupt.descriptor() == -1);
  CHECK(Interrupt(7).descriptor() == 7);
}

TEST_CASE("the signal decides which error it is") {
  struct Case {
    int signal;
    Errc code;
    int exit_status;
  };
  for (const auto& row : {Case{2, Errc::interrupted, 130}, Case{15, Errc::terminated, 143},
                          Case{1, Errc::terminated, 143}}) {
    const auto& [signal, code, exit_status] = row;
    CAPTURE(row.signal);
    Interrupt interrupt;
    interrupt.raise(signal);
    CHECK(interrupt.raised());
    CHECK(interrupt.error().code == code);
    CHECK(static_cast<int>(interrupt.error().status()) == exit_status);
  }
}

TEST_CASE("the first signal is the one that counts") {
  Interrupt interrupt;
  interrupt.raise(15);
  interrupt.raise(2);
  CHECK(interrupt.error().code == Errc::terminated);
}
