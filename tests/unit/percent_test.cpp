#include "spindle/base/percent.hpp"

#include <doctest/doctest.h>

using namespace spindle;

TEST_CASE("percent: every byte comes back from its code, and half a code is none") {
  for (int byte = 0; byte < 256; ++byte) {
    const char c = static_cast<char>(byte);
    CHECK(percent_decoded(percent_encoded(c)) == std::string(1, c));
  }
  CHECK(percent_encoded(' ') == "%20");
  CHECK(percent_encoded('\xFF') == "%FF");
  CHECK(percent_decoded("a%20b%2fc") == "a b/c");
  CHECK(percent_decoded("") == "");
  for (const char* half : {"%", "%2", "a%", "%zz", "%2z", "%%20"}) {
    CAPTURE(half);
    CHECK_FALSE(percent_decoded(half));
  }
}
