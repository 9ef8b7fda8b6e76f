#include "identity.hpp"

#include <algorithm>

#include "spindle/catalogue/identity.hpp"
#include "spindle/modbus/types.hpp"

namespace spindle::sim {
namespace {

using catalogue::IdentitySpec;
using catalogue::Slice;

bool holds(ByteView bytes, Slice slice) {
  return slice.size > 0 && std::size_t{slice.offset} + slice.size <= bytes.size();
}

void put_number(Bytes& bytes, Slice slice, std::uint64_t number) {
  if (!holds(bytes, slice)) return;
  for (std::size_t i = slice.size; i > 0; --i) {
    bytes[slice.offset + i - 1] = static_cast<std::uint8_t>(number & 0xFFU);
    number >>= 8U;
  }
}

// A long serial number stands in decimal pairs, the last pair first.
constexpr std::uint64_t pair = 100;

void put_pairs(Bytes& bytes, Slice slice, std::uint64_t number) {
  if (!holds(bytes, slice)) return;
  for (std::size_t i = 0; i < slice.size; ++i) {
    bytes[slice.offset + i] = static_cast<std::uint8_t>(number % pair);
    number /= pair;
  }
}

std::uint64_t get_pairs(ByteView bytes, Slice slice) {
  std::uint64_t number = 0;
  for (std::size_t i = slice.size; i > 0; --i) number = number * pair + bytes[slice.offset + i - 1];
  return number;
}

std::uint64_t get_number(ByteView bytes, Slice slice) {
  std::uint64_t number = 0;
  for (std::size_t i = 0; i < slice.size; ++i) number = number << 8U | bytes[slice.offset + i];
  return number;
}

enum class SerialForm : std::uint8_t { number, pairs };

SerialForm form_of(const IdentitySpec& facts, std::size_t size) {
  const bool is_long = facts.long_serial_bytes > 0 && size >= facts.long_serial_bytes;
  return is_long ? SerialForm::pairs : SerialForm::number;
}

std::uint64_t get_serial(const IdentitySpec& facts, ByteView bytes, SerialForm form) {
  const Slice slice = form == SerialForm::pairs ? facts.long_serial : facts.serial;
  if (!holds(bytes, slice)) return 0;
  return form == SerialForm::pairs ? get_pairs(bytes, slice) : get_number(bytes, slice);
}

void put_serial(const IdentitySpec& facts, Bytes& bytes, std::uint64_t serial) {
  if (form_of(facts, bytes.size()) == SerialForm::pairs) {
    put_pairs(bytes, facts.long_serial, serial);
  } else {
    put_number(bytes, facts.serial, serial);
  }
}

}  // namespace

Bytes make_identity(const std::optional<IdentitySpec>& facts,
                    const catalogue::SimulationSpec& start, const DeviceOptions& options) {
  const std::size_t usual = start.identity_bytes > 0 ? start.identity_bytes : start.identity.size();
  Bytes identity(start.identity.begin(), start.identity.end());
  constexpr std::size_t most = modbus::max_pdu_size - 2;
  identity.resize(std::min(options.identity_bytes.value_or(usual), most));
  if (!facts) return identity;
  if (options.firmware) put_number(identity, facts->firmware, *options.firmware);
  if (options.tool_model) put_number(identity, facts->tool_model, *options.tool_model);
  const SerialForm written = form_of(*facts, usual);
  if (options.serial) {
    put_serial(*facts, identity, *options.serial);
  } else if (written != form_of(*facts, identity.size())) {
    put_serial(*facts, identity, get_serial(*facts, start.identity, written));
  }
  return identity;
}

unsigned firmware_of(const std::optional<IdentitySpec>& facts,
                     const catalogue::SimulationSpec& start, const DeviceOptions& options) {
  if (!facts) return 0;
  return catalogue::decode_identity(*facts, make_identity(facts, start, options))
      .firmware.value_or(0);
}

}  // namespace spindle::sim
