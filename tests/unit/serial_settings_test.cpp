#include "spindle/modbus/serial_settings.hpp"

#include <doctest/doctest.h>

#include "spindle/link/endpoint.hpp"

using namespace spindle;
using namespace spindle::modbus;
using namespace std::chrono_literals;

TEST_CASE("a URL's settings win over the profile's") {
  const SerialSettings usual{.baud = 19200, .parity = Parity::odd, .stop_bits = 2};
  CHECK(link::serial_settings(link::parse_endpoint("rtu:///d").value(), usual) == usual);

  const auto telling = link::parse_endpoint("rtu:///d?baud=115200&parity=none&stop=1").value();
  CHECK(link::serial_settings(telling, usual) == SerialSettings{115200, Parity::none, 1});
}

TEST_CASE("a character takes its bits") {
  CHECK(character_time({9600, Parity::even, 1}) == 1145833ns);
  CHECK(character_time({115200, Parity::odd, 1}) == 95486ns);
  CHECK(character_time({9600, Parity::none, 1}) == 1041666ns);
  CHECK(character_time({1000000, Parity::even, 2}) == 12us);
}

TEST_CASE("the standard's silence: 3.5 characters of 11 bits, above 19200 baud 1.75 ms") {
  CHECK(standard_silence(9600) == 4010416ns);
  CHECK(standard_silence(19200) == 2005208ns);
  CHECK(standard_silence(38400) == 1750us);
  CHECK(standard_silence(115200) == 1750us);
}
