#include "spindle/modbus/crc16.hpp"

#include <doctest/doctest.h>

#include "unit/hex.hpp"

using namespace spindle;
using spindle::modbus::crc16;
using spindle::test::hex;

TEST_CASE("published check values") {
  struct Case {
    std::string_view source;
    std::string_view bytes;
    std::uint16_t crc;
  };
  for (const auto& row : {
           Case{"start value", "", 0xFFFF},
           Case{"Oriental Motor AR and BLV-R manuals", "02 07", 0x1241},
           Case{"catalogue of CRCs, CRC-16/MODBUS, '123456789'", "31 32 33 34 35 36 37 38 39",
                0x4B37},
           Case{"BLV manual HM-5114, p.16", "01 03 04 80 00 04", 0xD144},
           Case{"BLH RS-485 manual, function 17h",
                "01 17 13 0C 00 04 04 80 00 04 08 00 00 01 F4 00 00 09 C4", 0xB4CC},
       }) {
    const auto& [source, bytes, crc] = row;
    CAPTURE(row.source);
    CHECK(crc16(hex(bytes)) == crc);
  }
}

TEST_CASE("the CRC over a frame with its CRC is zero") {
  CHECK(crc16(hex("02 06 10 AB 00 32 7D 0C")) == 0);
}

TEST_CASE("every single-bit error is noticed") {
  const Bytes good = hex("01 03 08 00 00 00 64 00 00 0F A0");
  for (std::size_t bit = 0; bit < good.size() * 8; ++bit) {
    Bytes bad = good;
    bad[bit / 8] = static_cast<std::uint8_t>(bad[bit / 8] ^ (1U << (bit % 8)));
    CAPTURE(bit);
    CHECK(crc16(bad) != crc16(good));
  }
}
