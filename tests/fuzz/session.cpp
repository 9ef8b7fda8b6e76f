// Any bytes, in any pieces and at any time, before one dialogue. First byte: bit 0 the framing, bit
// 1 whether the line is proved, bits 2 to 4 the number of requests. Then pieces: the time in ms
// since the one before, the length, the bytes.

#include "spindle/link/session.hpp"

#include "input.hpp"
#include "support/scripted_transport.hpp"

using namespace spindle;
using namespace spindle::link;
using namespace std::chrono_literals;
using modbus::Framing;
using modbus::RegisterTable;
using spindle::fuzz::require;

namespace {

constexpr Duration answer_timeout = 1s;
constexpr std::uint8_t event_bytes = 28;

SessionOptions options_of(std::uint8_t choice) {
  SessionOptions options;
  options.rules.framing = (choice & 1U) != 0 ? Framing::rtu : Framing::tcp;
  options.rules.spontaneous = {{4, event_bytes}};
  options.unit = {1};
  options.answer_timeout = answer_timeout;
  if (options.rules.framing == Framing::rtu) {
    options.gap = 5ms;
    if ((choice & 2U) != 0) options.proof = SessionOptions::Proof::loopback;
  }
  return options;
}

void play_pieces(fuzz::Input& input, test::Script& script) {
  TimePoint when = script.clock->now();
  while (!input.empty()) {
    when += std::chrono::milliseconds(input.byte());
    const std::size_t length = input.byte();
    script.arrive(when, input.bytes(length));
  }
}

/// Whatever is taken for the answer has its shape.
void check_answer(const modbus::Pdu& request, std::uint16_t count, const modbus::Pdu& answer) {
  const bool is_exception = answer.function == (request.function | 0x80U);
  require(is_exception || answer.function == request.function);
  require(!is_exception || answer.data.size() == 1);
  require(is_exception || answer.data.size() == 1U + 2U * count);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Input input(data, size);
  const std::uint8_t choice = input.byte();
  const SessionOptions options = options_of(choice);
  test::FakeClock clock;
  test::Script script(clock);
  play_pieces(input, script);
  Session session(test::transport_to(script), clock, options);
  const unsigned requests = 1U + ((choice >> 2U) & 7U);
  for (unsigned number = 0; number < requests; ++number) {
    const auto count = static_cast<std::uint16_t>(1 + number);
    const auto request = modbus::read_request(RegisterTable::holding, {2}, count);
    const TimePoint start = clock.now();
    const auto answer = session.transact(request);
    if (answer) check_answer(request, count, *answer);
    require(answer || !describe(answer.error()).empty());
    // A quarantine before the request may take a time of its own, but never for ever.
    require(clock.now() - start <= 10 * answer_timeout);
  }
  while (const auto event = session.next_spontaneous(clock.now() + answer_timeout)) {
    if (!*event) break;
    require((*event)->pdu.data.size() == 1U + event_bytes);
  }
  return 0;
}
