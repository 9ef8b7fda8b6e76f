#include "spindle/device/discovery.hpp"

#include <doctest/doctest.h>

#include "spindle/files/profile_store.hpp"
#include "spindle/posix/disk.hpp"
#include "spindle/shipped/profiles.hpp"
#include "unit/hex.hpp"

using namespace spindle;
using namespace spindle::device;

namespace {

catalogue::DiscoverySpec spec() {
  const files::ProfileStore store({std::string(SPINDLE_SOURCE_DIR) + "/profiles"},
                                  posix::source_disk(), shipped::profiles());
  return store.load("doga-gen2").value().discovery.value();
}

/// protocol/bm-bmt-gen2.md, section 14.
const char* const answer =
    "000700823234303131393030343200000000000000000C90C0A801641388001122334455000FA203";

}  // namespace

TEST_CASE("discovery: the frames of the facts") {
  CHECK(discovery_question(spec(), 7) == test::hex("00070001"));
  const auto tool = decode_found(spec(), {7}, test::hex(answer));
  REQUIRE(tool);
  CHECK(tool->serial == "2401190042");
  CHECK(tool->model == 3216U);
  CHECK(tool->address == "192.168.1.100");
  CHECK(tool->port == 5000);
  CHECK(tool->mac == "00:11:22:33:44:55");
  CHECK(tool->firmware == 4002U);
  CHECK(tool->in_use == false);
  CHECK(tool->kind == 3U);
  CHECK(tool->kind_name == "BMT");
}

TEST_CASE("discovery: what is no answer to one of our questions says nothing") {
  const Bytes good = test::hex(answer);
  CHECK_FALSE(decode_found(spec(), {8}, good));
  CHECK_FALSE(decode_found(spec(), {}, good));
  CHECK(decode_found(spec(), {6, 7, 8}, good));
  for (std::size_t size = 0; size < good.size(); ++size) {
    CAPTURE(size);
    CHECK_FALSE(decode_found(spec(), {7}, ByteView(good).first(size)));
  }
  Bytes longer = good;
  longer.push_back(0);
  CHECK_FALSE(decode_found(spec(), {7}, longer));
  for (const unsigned type : {0x01U, 0x02U, 0x81U, 0x83U, 0xFFU}) {
    Bytes other = good;
    other[3] = static_cast<std::uint8_t>(type);
    CHECK_FALSE(decode_found(spec(), {7}, other));
  }
  for (const unsigned byte : {0x1BU, 0x0AU, 0x7FU, 0xC3U}) {
    Bytes strange = good;
    strange[6] = static_cast<std::uint8_t>(byte);
    CHECK_FALSE(decode_found(spec(), {7}, strange));
  }
}

TEST_CASE("discovery: what is zero is not told") {
  const auto tool = decode_found(spec(), {7},
                                 test::hex("00070082" + std::string(20 * 2, '0') + "00000000" +
                                           "0000" + "000000000000" + "01" + "0000" + "4D"));
  REQUIRE(tool);
  CHECK(tool->serial.empty());
  CHECK(tool->address.empty());
  CHECK_FALSE(tool->port);
  CHECK(tool->mac.empty());
  CHECK(tool->in_use == true);
  CHECK(tool->kind == 77U);
  CHECK(tool->kind_name.empty());
}

TEST_CASE("discovery: a tool is told once, and a flood is bounded") {
  FoundTools found;
  FoundTool tool{.serial = "1", .address = "10.0.0.1", .port = 5000};
  CHECK(found.add(tool) == FoundTools::Added::yes);
  CHECK(found.add(tool) == FoundTools::Added::known);
  tool.in_use = true;
  CHECK(found.add(tool) == FoundTools::Added::known);
  tool.port = 5001;
  CHECK(found.add(tool) == FoundTools::Added::yes);
  for (std::size_t more = 2; more < FoundTools::most; ++more) {
    tool.serial = std::to_string(more);
    CHECK(found.add(tool) == FoundTools::Added::yes);
  }
  tool.serial = "one more";
  CHECK(found.add(tool) == FoundTools::Added::no_room);
  tool = {.serial = "1", .address = "10.0.0.1", .port = 5000};
  CHECK(found.add(tool) == FoundTools::Added::known);
}
