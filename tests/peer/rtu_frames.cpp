// Prints frames that spindle builds for a serial line, one a line: direction (O to the server, I
// from it) and its bytes. Another program judges them.
#include <array>
#include <cstdio>
#include <utility>
#include <vector>

#include "spindle/modbus/adu.hpp"
#include "spindle/modbus/pdu.hpp"

int main() {
  using namespace spindle;
  using namespace spindle::modbus;
  constexpr UnitId unit{3};
  constexpr auto holding = RegisterTable::holding;
  constexpr auto input = RegisterTable::input;
  const Registers two = {271, 1000};
  const Registers most = Registers(max_read_count, 0xA55A);
  const std::vector<std::pair<char, Pdu>> frames = {
      {'O', read_request(holding, {2}, 2)},
      {'I', read_response(holding, two)},
      {'O', read_request(input, {3200}, 14)},
      {'I', read_response(input, Registers(14, 7))},
      {'O', read_request(holding, {0}, max_read_count)},
      {'I', read_response(holding, most)},
      {'O', write_request(RegisterAddress{4002}, 1)},
      {'I', write_request(RegisterAddress{4002}, 1)},
      {'O', loopback_request(0xA537)},
      {'I', loopback_request(0xA537)},
      {'O', write_request(RegisterAddress{0x0480}, two)},
      {'I', write_multiple_response({0x0480}, 2)},
      {'O', read_request(holding, {564}, 5)},
      {'I', exception_response(0x03, 0x02)},
      {'I', report_server_id_response(Bytes{0x00, 0x01, 0x00, 0x03})},
  };
  for (const auto& [direction, pdu] : frames) {
    const Bytes bytes = frame(Framing::rtu, {.transaction = {}, .unit = unit, .pdu = pdu});
    std::printf("%c %s\n", direction, to_hex(bytes).c_str());
  }
  return 0;
}
