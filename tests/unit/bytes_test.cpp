#include "spindle/base/bytes.hpp"

#include <doctest/doctest.h>

using namespace spindle;

TEST_CASE("16-bit items are sent high byte first") {
  Bytes bytes{0x55};
  put_u16(bytes, 0x0102);
  put_u16(bytes, 0xFFFE);
  CHECK(bytes == Bytes{0x55, 0x01, 0x02, 0xFF, 0xFE});
  CHECK(get_u16(bytes, 1) == 0x0102);
  CHECK(get_u16(bytes, 2) == 0x02FF);
  CHECK(get_u16(bytes, 3) == 0xFFFE);
}

TEST_CASE("every 16-bit word survives put and get") {
  for (unsigned word = 0; word <= 0xFFFF; ++word) {
    Bytes bytes;
    put_u16(bytes, static_cast<std::uint16_t>(word));
    REQUIRE(bytes.size() == 2);
    REQUIRE(get_u16(bytes, 0) == word);
  }
}

TEST_CASE("hexadecimal text has two upper-case digits a byte") {
  CHECK(to_hex(Bytes{}).empty());
  CHECK(to_hex(Bytes{0x00}) == "00");
  CHECK(to_hex(Bytes{0x00, 0x1F, 0xA0}) == "00 1F A0");
  CHECK(to_compact_hex(Bytes{}).empty());
  CHECK(to_compact_hex(Bytes{0x00, 0x1F, 0xA0}) == "001FA0");
}
