#include "bm_identity.hpp"

#include <limits>

namespace spindle::sim {
namespace {

using catalogue::IdentityFacts;
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

bool is_long(const IdentityFacts& facts, std::size_t size) {
  return facts.long_serial_bytes > 0 && size >= facts.long_serial_bytes;
}

std::optional<std::uint64_t> serial_of(const IdentityFacts& facts, const Bytes& longest,
                                       const BmOptions& options) {
  if (options.serial) return *options.serial;
  if (!is_long(facts, longest.size()) || !holds(longest, facts.long_serial)) return std::nullopt;
  const std::uint64_t serial = get_pairs(longest, facts.long_serial);
  if (serial > std::numeric_limits<std::uint32_t>::max()) return std::nullopt;
  return serial;
}

}  // namespace

Bytes make_identity(const std::optional<IdentityFacts>& facts,
                    const catalogue::SimulationFacts& start, const BmOptions& options) {
  const std::size_t usual = start.identity_bytes > 0 ? start.identity_bytes : start.identity.size();
  Bytes identity = start.identity;
  identity.resize(options.identity_bytes.value_or(usual));
  if (!facts) return identity;
  if (options.firmware) put_number(identity, facts->firmware, *options.firmware);
  if (options.tool_model) put_number(identity, facts->tool_model, *options.tool_model);
  if (const auto serial = serial_of(*facts, start.identity, options)) {
    if (is_long(*facts, identity.size())) {
      put_pairs(identity, facts->long_serial, *serial);
    } else {
      put_number(identity, facts->serial, *serial);
    }
  }
  return identity;
}

}  // namespace spindle::sim
