// A thousand and more requests of every kind on one serial line, each checked; for judging the gaps
// by the other side's log:
//
//   spindle_peer_serial_mix PATH BAUD GAP_MICROSECONDS COUNT
//
// Prints "COUNT answered" or what went wrong.
#include <iostream>
#include <string>

#include "spindle/link/session.hpp"
#include "spindle/modbus/pdu.hpp"
#include "spindle/posix/clock.hpp"
#include "spindle/posix/serial.hpp"

namespace {

using namespace spindle;
using modbus::RegisterAddress;
using modbus::RegisterTable;

constexpr unsigned kinds = 10;

/// The request of this turn. No broadcasts: on a pseudo terminal their sender cannot know when
/// they were heard.
modbus::Pdu request_of(std::uint16_t turn) {
  const auto value = static_cast<std::uint16_t>(turn * 7);
  switch (turn % kinds) {
    case 0:
      return modbus::write_request(RegisterAddress{0x7D}, value);
    case 1:
    case 4:
      return modbus::read_request(RegisterTable::holding, {0x7D}, 1);
    case 2:
    case 5:
      return modbus::loopback_request(value);
    case 3:
      return modbus::write_request(RegisterAddress{0x0480}, Registers{0, value});
    case 6:
      return modbus::read_request(RegisterTable::holding, {0x0480}, 2);
    case 7:
      return modbus::write_request(RegisterAddress{0x0485}, value);
    case 8:
      return modbus::read_request(RegisterTable::holding, {0x1FFF}, 2);
    default:
      return modbus::read_request(RegisterTable::holding, {turn}, 4);
  }
}

/// Whether the answer says what the server must know by now.
bool is_right(std::uint16_t turn, const modbus::Pdu& answer) {
  const auto value_of = [&](unsigned kind) {
    return static_cast<std::uint16_t>((turn - turn % kinds + kind) * 7);
  };
  switch (turn % kinds) {
    case 1:
    case 4:
      return modbus::registers_of(answer) == Registers{value_of(0)};
    case 6:
      return modbus::registers_of(answer) == Registers{0, value_of(3)};
    case 8:
      return answer == modbus::exception_response(0x03, 0x02);
    case 9:
      return modbus::registers_of(answer).size() == 4;
    default:
      return true;  // the session has compared what is repeated
  }
}

Result<void> ask(link::Session& session, std::uint16_t turn) {
  const modbus::Pdu request = request_of(turn);
  auto answer = session.transact(request);
  if (!answer) return tl::unexpected(std::move(answer.error()));
  if (is_right(turn, *answer)) return {};
  return tl::unexpected(Error{.code = Errc::mismatch, .message = "a wrong value"});
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 5) return 2;
  const auto baud = static_cast<unsigned>(std::stoul(arguments[2]));
  const Duration gap = std::chrono::microseconds(std::stoul(arguments[3]));
  const auto turns = static_cast<std::uint16_t>(std::stoul(arguments[4]));
  const Interrupt never;
  posix::SteadyClock clock(never);
  const modbus::SerialSettings line{.baud = baud};
  auto port = posix::open_serial(arguments[1], line, link::LineSwitching::adapter, clock, never);
  if (!port) {
    std::cout << describe(port.error()) << '\n';
    return 1;
  }
  link::Session session(std::move(*port), clock,
                        {.rules = {.framing = modbus::Framing::rtu, .spontaneous = {}},
                         .unit = {1},
                         .answer_timeout = std::chrono::seconds(1),
                         .gap = gap,
                         .broadcast_gap = gap + std::chrono::milliseconds(5),
                         .character_time = modbus::character_time(line),
                         .in_use_until = clock.now()});
  for (std::uint16_t turn = 0; turn < turns; ++turn) {
    if (const auto asked = ask(session, turn); !asked) {
      std::cout << "request " << turn << ": " << describe(asked.error()) << '\n';
      return 1;
    }
  }
  std::cout << turns << " answered\n";
  return 0;
}
