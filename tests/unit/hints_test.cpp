#include "device/hints.hpp"

#include <doctest/doctest.h>

#include <string>

#include "spindle/catalogue/document_number.hpp"

using namespace spindle;
using device::Asked;

namespace {

const Error silence = {.code = Errc::no_answer};

struct Case {
  explicit Case(const std::string& url) : endpoint(link::parse_endpoint(url).value()) {}

  std::string hint(const Error& error = silence, bool answered_before = false) {
    return device::hint_for_silence(error, {endpoint, profile, {unit}, answered_before});
  }
  bool says(std::string_view text) { return hint().find(text) != std::string::npos; }

  link::Endpoint endpoint;
  catalogue::Profile profile = {};
  std::uint8_t unit = 1;
};

}  // namespace

TEST_CASE("hints: a silent unit suggests another one, where units mean something") {
  CHECK(Case("rtu:///dev/ttyUSB0").says("unit 1 was asked"));
  CHECK(Case("rtu:///dev/ttyUSB0").says("?unit=N"));
  CHECK(Case("tcp://h:502").says("?unit=N"));
  Case driver("rtu:///dev/ttyUSB0?unit=40");
  driver.unit = 40;
  driver.profile.id = "blv";
  driver.profile.series = "BLV";
  driver.profile.link.units = catalogue::UnitRange{1, 31};
  CHECK(driver.says("unit 40 was asked, and a BLV can only be 1 to 31"));
  Case screwdriver("tcp://h:502");
  screwdriver.profile.id = "bm";
  screwdriver.profile.events.emplace();
  CHECK(screwdriver.hint().empty());
  CHECK(Case("rtu:///dev/ttyUSB0").hint(silence, true).find("unit") == std::string::npos);
}

TEST_CASE("hints: the framing that the target does not name") {
  CHECK(Case("tcp://h:502").says("rtu+tcp://h:502"));
  Case driver("tcp://h:4001?unit=2");
  driver.profile.id = "blv";
  driver.profile.link.framing = modbus::Framing::rtu;
  CHECK(driver.says("write rtu+tcp://h:4001?unit=2"));
  CHECK(Case("rtu+tcp://h:502?unit=1").says("tcp://h:502?unit=1"));
  CHECK(Case("rtu+tcp://h:502").hint({.code = Errc::closed}) ==
        "does it speak Modbus TCP? then write tcp://h:502");
  CHECK(Case("tcp://h:502").hint({.code = Errc::closed}).empty());
  CHECK(Case("rtu+tcp://h:502").hint({.code = Errc::closed}, true).empty());
  CHECK(Case("tcp://h:502").hint({.code = Errc::no_answer, .hint = "known"}).empty());
}

TEST_CASE("hints: numbers of documents are named as registers that count from 0") {
  using catalogue::hint_for_document_number;
  CHECK(hint_for_document_number("40001") ==
        "registers count from 0: 40001 in a document is @holding:0");
  CHECK(hint_for_document_number("@holding:40108/i16") ==
        "registers count from 0: 40108 in a document is @holding:107/i16");
  CHECK(hint_for_document_number("@input:30001") ==
        "registers count from 0: 30001 in a document is @input:0");
  CHECK(hint_for_document_number("400001").ends_with("@holding:0"));
  CHECK(hint_for_document_number("465536").ends_with("@holding:65535"));
  for (const char* other : {"0", "40000", "50000", "465537", "x", "@holding:2", ""}) {
    CAPTURE(other);
    CHECK(hint_for_document_number(other).empty());
  }
  Error refused{.code = Errc::exception_response, .register_address = 40001, .exception = 2};
  CHECK(device::hint_for_absent_register(refused).ends_with("@holding:0"));
  refused.exception = 4;
  CHECK(device::hint_for_absent_register(refused).empty());
}
