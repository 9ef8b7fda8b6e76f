#include "spindle/link/serial_settings.hpp"

#include <doctest/doctest.h>

using namespace spindle;
using namespace spindle::link;
using namespace std::chrono_literals;

TEST_CASE("a URL's settings win over the profile's") {
  const Endpoint silent = parse_endpoint("rtu:///d").value();
  SerialSettings line = serial_settings(silent, 19200, 'O', 2);
  CHECK(line.baud == 19200);
  CHECK(line.parity == Parity::odd);
  CHECK(line.stop_bits == 2);
  CHECK(serial_settings(silent, 9600, 'N', 1).parity == Parity::none);
  CHECK(serial_settings(silent, 9600, 'E', 1).parity == Parity::even);

  const Endpoint telling = parse_endpoint("rtu:///d?baud=115200&parity=none&stop=1").value();
  line = serial_settings(telling, 19200, 'O', 2);
  CHECK(line.baud == 115200);
  CHECK(line.parity == Parity::none);
  CHECK(line.stop_bits == 1);
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
