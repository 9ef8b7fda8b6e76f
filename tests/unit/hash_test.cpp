#include "spindle/base/hash.hpp"

#include <doctest/doctest.h>

using namespace spindle;

// By the test vectors of the hash's authors (fnv1a 64 of "", "a" and "foobar").
TEST_CASE("hash: a text has the same number for ever, in one piece or in several") {
  CHECK(hash_of("") == 0xCBF29CE484222325U);
  CHECK(hash_of("a") == 0xAF63DC4C8601EC8CU);
  CHECK(hash_of("foobar") == 0x85944171F73967E8U);
  CHECK(hash_of("bar", hash_of("foo")) == hash_of("foobar"));
}
