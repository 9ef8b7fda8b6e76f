// Serves a bus of units with holding registers (tests/support/serial_bank.hpp) on a pseudo terminal
// or a port, and writes down what it hears and says, each with its time:
//
//   spindle_peer_serial_bank --pty PATH | --port [--baud N] [--units N] [--gap MICROSECONDS]
//                            [--delay MICROSECONDS] [--no-gap] [--no-wire] [--log FILE]
//                            [--fault SPEC]...
//
// The first line of output says where it serves. A line of the log: nanoseconds, '>' (query) or '<'
// (answer), bytes. The last two count queries carried out and frames that were none.
#include "support/serial_bank.hpp"

#include <cstdio>
#include <fstream>
#include <iostream>
#include <string>
#include <vector>

#include "spindle/modbus/serial_settings.hpp"
#include "spindle/posix/clock.hpp"
#include "spindle/posix/serve.hpp"
#include "spindle/posix/signals.hpp"

namespace {

using namespace spindle;

struct Wish {
  sim::ServeOptions serve = {.framing = modbus::Framing::rtu, .baud = 9600};
  test::SerialBank::Options bank = {};
  bool wire = true;
  std::string log = {};
};

Wish understand(const std::vector<std::string>& words) {
  Wish wish;
  for (std::size_t index = 0; index < words.size(); ++index) {
    const std::string& word = words[index];
    const auto next = [&]() -> const std::string& { return words.at(++index); };
    const auto number = [&] { return static_cast<unsigned>(std::stoul(next())); };
    if (word == "--pty") wish.serve.pty = next();
    if (word == "--baud") wish.serve.baud = number();
    if (word == "--gap") wish.bank.gap = std::chrono::microseconds(number());
    if (word == "--delay") wish.bank.delay = std::chrono::microseconds(number());
    if (word == "--no-gap") wish.serve.line.gaps = sim::LineModel::Gaps::ignored;
    if (word == "--no-wire") wish.wire = false;
    if (word == "--log") wish.log = next();
    if (word == "--fault") wish.serve.faults.push_back(sim::parse_fault(next()).value());
    if (word == "--units") {
      const unsigned last = number();
      wish.bank.units.clear();
      for (unsigned unit = 1; unit <= last; ++unit)
        wish.bank.units.push_back({static_cast<std::uint8_t>(unit)});
    }
  }
  if (wish.wire) wish.serve.line.character_time = modbus::character_time({.baud = wish.serve.baud});
  return wish;
}

}  // namespace

int main(int count, char** arguments) {
  Wish wish = understand({arguments + 1, arguments + count});
  posix::SignalWatch signals;
  posix::SteadyClock clock(signals.interrupt());
  std::ofstream log;
  if (!wish.log.empty()) log.open(wish.log);
  wish.serve.listening = [&](std::uint16_t port) -> Result<void> {
    const std::string where = wish.serve.pty.empty() ? "rtu+tcp://127.0.0.1:" + std::to_string(port)
                                                     : "rtu://" + wish.serve.pty;
    std::cout << where << std::endl;
    return {};
  };
  wish.serve.log = [&](sim::Heard heard, std::uint32_t, ByteView bytes) {
    if (heard != sim::Heard::request && heard != sim::Heard::response) return;
    log << clock.now().time_since_epoch().count() << (heard == sim::Heard::request ? " > " : " < ")
        << to_hex(bytes) << '\n';
  };
  test::SerialBank bank(wish.bank);
  const auto served = posix::tool_server(clock, signals.interrupt())(bank, wish.serve);
  log << "queries " << bank.queries << "\nbad " << bank.bad_frames << '\n';
  if (served) return 0;
  std::cerr << describe(served.error()) << '\n';
  return 1;
}
