#include "spindle/catalogue/identity.hpp"

#include <doctest/doctest.h>

#include <string>
#include <string_view>

using namespace spindle;
using namespace spindle::catalogue;

namespace {

/// Layout of DOGA 60427 §3.4; the long serial and the total are those of the maker's library.
IdentitySpec doga() {
  return {.minimum_bytes = 12,
          .id = {0, 2},
          .controller_model = {2, 2},
          .tool_model = {4, 2},
          .firmware = {6, 2},
          .serial = {8, 4},
          .long_serial_bytes = 13,
          .long_serial = {8, 5},
          .product_byte = 10,
          .products = {{10, "doga-bm"}, {19, "doga-bmt"}, {29, "doga-bmt"}},
          .total_bytes = 17,
          .total = {13, 4},
          .models = {{0, "unknown"}, {3, "3204"}, {9, "3245"}},
          .firmware_below = 4000};
}

const Bytes short_answer = {0x00, 0x01, 0x00, 0x02, 0x00, 0x03, 0x08, 0x37, 0x3C, 0xDC, 0xC0, 0x0A};
const Bytes long_answer = {0x00, 0x01, 0x00, 0x02, 0x00, 0x09, 0x08, 0xA7, 0x2A,
                           0x07, 0x13, 0x17, 0x01, 0x00, 0x00, 0x29, 0x30};

Bytes text(std::string_view characters) { return {characters.begin(), characters.end()}; }

Bytes with_firmware(std::uint16_t firmware) {
  Bytes answer = short_answer;
  answer[6] = static_cast<std::uint8_t>(firmware >> 8U);
  answer[7] = static_cast<std::uint8_t>(firmware);
  return answer;
}

Generation generation(const Bytes& answer) {
  return generation_of(doga(), decode_identity(doga(), answer));
}

}  // namespace

TEST_CASE("12 bytes: the serial is a number, and products are not told apart") {
  const Identity identity = decode_identity(doga(), short_answer);
  CHECK(identity.raw == short_answer);
  CHECK(identity.id == 1U);
  CHECK(identity.controller_model_code == 2U);
  CHECK(identity.tool_model_code == 3U);
  CHECK(identity.tool_model == "3204");
  CHECK(identity.firmware == 2103U);
  CHECK(identity.serial == "1021100042");
  CHECK(identity.product_profile.empty());
  CHECK_FALSE(identity.total.has_value());
  CHECK(identity.notes.empty());
}

TEST_CASE(
    "13 bytes and more: the serial is read from its last byte, the middle one is the product") {
  const Bytes thirteen(long_answer.begin(), long_answer.begin() + 13);
  const Identity identity = decode_identity(doga(), thirteen);
  CHECK(identity.serial == "0123190742");
  CHECK(identity.product_profile == "doga-bmt");
  CHECK(identity.tool_model == "3245");
  CHECK_FALSE(identity.total.has_value());

  CHECK(decode_identity(doga(), long_answer).total == 10544U);

  Bytes longer = long_answer;
  longer.insert(longer.end(), {1, 2, 3});
  CHECK(decode_identity(doga(), longer).serial == "0123190742");
  CHECK(generation(longer) == Generation::known);
}

TEST_CASE("a long serial that is not decimal is shown as it is") {
  Bytes answer = long_answer;
  answer[8] = 0xDC;
  const Identity identity = decode_identity(doga(), answer);
  CHECK(identity.serial == "DC07131701");
  REQUIRE(identity.notes.size() == 1);
  CHECK(identity.notes[0] == "serial number is not made of decimal pairs, shown as hexadecimal");
}

TEST_CASE("unknown codes are notes, not errors") {
  Bytes answer = long_answer;
  answer[5] = 77;
  answer[10] = 55;
  const Identity identity = decode_identity(doga(), answer);
  CHECK(identity.tool_model.empty());
  CHECK(identity.tool_model_code == 77U);
  CHECK(identity.product_profile.empty());
  CHECK(identity.notes == std::vector<std::string>{"tool model code 77 is not known",
                                                   "product code 55 is not known"});
  CHECK(generation_of(doga(), identity) == Generation::unknown);
}

TEST_CASE("generation follows the firmware number") {
  CHECK(generation(with_firmware(1)) == Generation::known);
  CHECK(generation(with_firmware(3999)) == Generation::known);
  CHECK(generation(with_firmware(4000)) == Generation::later);
  CHECK(generation(with_firmware(65535)) == Generation::later);
  CHECK(generation(with_firmware(0)) == Generation::unknown);
}

TEST_CASE("model code 0 is in the manual's table: known") {
  Bytes answer = short_answer;
  answer[5] = 0;
  CHECK(generation(answer) == Generation::known);
}

TEST_CASE("other servers' answers are unknown and leave the fields empty") {
  Bytes libmodbus = {0xB4, 0xFF};  // libmodbus 3.1.6, modbus_reply()
  const Bytes name = text("LMB3.1.6");
  libmodbus.insert(libmodbus.end(), name.begin(), name.end());
  Bytes later_libmodbus = libmodbus;
  later_libmodbus.insert(later_libmodbus.end(), {'1', '0', '0'});
  for (const Bytes& answer : {text("Pymodbus-PM-3.0"), libmodbus, later_libmodbus, text("x"),
                              Bytes{}, Bytes(short_answer.begin(), short_answer.end() - 1)}) {
    CAPTURE(to_hex(answer));
    const Identity identity = decode_identity(doga(), answer);
    CHECK(identity.raw == answer);
    CHECK_FALSE(identity.firmware.has_value());
    CHECK_FALSE(identity.tool_model_code.has_value());
    CHECK(identity.serial.empty());
    CHECK(identity.notes.size() == 1);
    CHECK(generation(answer) == Generation::unknown);
  }
}

TEST_CASE("every prefix of an answer is read without harm") {
  for (std::size_t size = 0; size <= long_answer.size(); ++size) {
    const Bytes answer(long_answer.begin(), long_answer.begin() + static_cast<int>(size));
    CAPTURE(size);
    CHECK((generation(answer) == Generation::known) == (size >= 12));
  }
}

namespace {

/// Of firmware 4000 and later there is no table of models.
IdentitySpec later_doga() {
  IdentitySpec facts = doga();
  facts.minimum_bytes = 13;
  facts.products = {{10, "doga-gen2"}, {19, "doga-gen2"}};
  facts.models = {};
  facts.firmware_below = 0;
  facts.firmware_from = 4000;
  facts.cautions = {{.from = 4000, .to = 4001, .text = "look twice"}};
  return facts;
}

Identity later_identity(std::uint16_t firmware, std::uint8_t product = 19) {
  Bytes answer = long_answer;
  answer[6] = static_cast<std::uint8_t>(firmware >> 8U);
  answer[7] = static_cast<std::uint8_t>(firmware);
  answer[10] = product;
  return decode_identity(later_doga(), answer);
}

}  // namespace

TEST_CASE("without a table of models a tool is known by its product, and by its firmware") {
  const auto generation = [](std::uint16_t firmware, std::uint8_t product = 19) {
    return generation_of(later_doga(), later_identity(firmware, product));
  };
  CHECK(generation(4000) == Generation::known);
  CHECK(generation(65535) == Generation::known);
  CHECK(generation(3999) == Generation::earlier);
  CHECK(generation(0) == Generation::unknown);
  CHECK(generation(4002, 15) == Generation::unknown);
  CHECK(generation(3999, 15) == Generation::unknown);
  CHECK(later_identity(4002).notes.empty());
  CHECK(later_identity(4002, 15).notes == std::vector<std::string>{"product code 15 is not known"});
  const Identity twelve = decode_identity(later_doga(), short_answer);
  CHECK(generation_of(later_doga(), twelve) == Generation::unknown);
}

TEST_CASE("a caution is of the firmware of its range") {
  CHECK(caution_of(later_doga(), later_identity(3999)).empty());
  CHECK(caution_of(later_doga(), later_identity(4000)) == "look twice");
  CHECK(caution_of(later_doga(), later_identity(4001)) == "look twice");
  CHECK(caution_of(later_doga(), later_identity(4002)).empty());
  CHECK(caution_of(later_doga(), Identity()).empty());
}
