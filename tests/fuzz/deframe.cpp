// Any bytes before the framer. First byte: bit 0 the framing, bit 1 the role.

#include "input.hpp"
#include "spindle/modbus/adu.hpp"

using namespace spindle;
using namespace spindle::modbus;
using spindle::fuzz::require;

namespace {

/// A frame that was found can be framed again, and is found again.
void check_frame(Framing framing, Role role, const Deframed& found) {
  const Bytes again = frame(framing, found.adu);
  const Deframing second = deframe(framing, role, again);
  const auto* same = std::get_if<Deframed>(&second);
  require(same != nullptr);
  require(same->adu.pdu == found.adu.pdu);
  require(same->adu.unit == found.adu.unit);
  require(same->consumed == again.size());
  require(again.size() <= max_adu_size);
}

/// How many bytes are done with; 0 when more are needed.
std::size_t step(Framing framing, Role role, ByteView buffered) {
  const Deframing result = deframe(framing, role, buffered);
  if (const auto* found = std::get_if<Deframed>(&result)) {
    require(found->consumed > found->skipped);
    require(found->consumed <= buffered.size());
    check_frame(framing, role, *found);
    // On TCP nothing is found before the last byte is there.
    const ByteView shorter = buffered.first(found->consumed - 1);
    require(framing == Framing::rtu ||
            std::holds_alternative<NeedMore>(deframe(framing, role, shorter)));
    return found->consumed;
  }
  if (const auto* junk = std::get_if<Junk>(&result)) {
    require(junk->size > 0);
    require(junk->size <= buffered.size());
    require(!junk->reason.empty());
    return junk->size;
  }
  require(buffered.size() <= max_adu_size);
  return 0;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Input input(data, size);
  const std::uint8_t choice = input.byte();
  const Framing framing = (choice & 1U) != 0 ? Framing::rtu : Framing::tcp;
  const Role role = (choice & 2U) != 0 ? Role::server : Role::client;
  ByteView buffered = input.rest();
  for (std::size_t done = 1; done > 0 && !buffered.empty();) {
    done = step(framing, role, buffered);
    buffered = buffered.subspan(done);
  }
  return 0;
}
