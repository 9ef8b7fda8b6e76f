#include "spindle/base/ipv4.hpp"

#include <doctest/doctest.h>

using namespace spindle;

TEST_CASE("ipv4: four decimal numbers and nothing else") {
  CHECK(parse_ipv4("192.168.10.23") == 0xC0A80A17U);
  CHECK(parse_ipv4("0.0.0.0") == 0U);
  CHECK(parse_ipv4("255.255.255.255") == 0xFFFFFFFFU);
  for (const char* text :
       {"", "1.2.3", "1.2.3.4.5", "1.2.3.256", "1.2.3.-4", "1.2.3.04", "01.2.3.4", "1.2.3.0x4",
        "1.2.3.", " 1.2.3.4", "1.2.3.4 ", "a.b.c.d", "::1"}) {
    CAPTURE(text);
    CHECK_FALSE(parse_ipv4(text));
  }
  CHECK(ipv4_text(0xC0A80A17U) == "192.168.10.23");
}

TEST_CASE("ipv4: a network is an address and how many bits all have in common") {
  const auto network = parse_ipv4_network("192.168.10.23/24");
  REQUIRE(network);
  CHECK(ipv4_text(network->first) == "192.168.10.0");
  CHECK(ipv4_text(network->last) == "192.168.10.255");
  CHECK(network->prefix == 24);
  const auto one = parse_ipv4_network("10.1.2.3");
  REQUIRE(one);
  CHECK((one->first == one->last && one->prefix == 32));
  const auto all = parse_ipv4_network("1.2.3.4/0");
  REQUIRE(all);
  CHECK((all->first == 0 && all->last == 0xFFFFFFFFU));
  for (const char* text :
       {"1.2.3.4/", "1.2.3.4/33", "1.2.3.4/-1", "/24", "1.2.3/24", "1.2.3.4/24/1"}) {
    CAPTURE(text);
    CHECK_FALSE(parse_ipv4_network(text));
  }
}
