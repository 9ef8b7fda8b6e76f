#include "spindle/modbus/adu.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "spindle/modbus/crc16.hpp"

namespace spindle::modbus {
namespace {

constexpr std::size_t mbap_size = 7;       // up to and including the unit identifier
constexpr std::size_t mbap_length_at = 4;  // the length field counts what stands behind it
constexpr std::size_t mbap_length_end = 6;
constexpr std::size_t min_mbap_length = 2;  // unit and function
constexpr std::size_t max_mbap_length = 1 + max_pdu_size;
constexpr std::size_t max_mbap_length_of_long = max_long_adu_size - mbap_length_end;
constexpr std::size_t long_head = mbap_size + 1 + 2;  // with the length of the data

constexpr std::size_t rtu_head = 2;  // unit and function
constexpr std::size_t crc_size = 2;
constexpr std::size_t max_rtu_size = 1 + max_pdu_size + crc_size;

Pdu pdu_of(std::uint8_t function, ByteView data) {
  return Pdu{.function = function, .data = Bytes(data.begin(), data.end())};
}

Bytes frame_tcp(const Adu& adu) {
  Bytes bytes;
  bytes.reserve(mbap_size + 1 + adu.pdu.data.size());
  put_u16(bytes, adu.transaction.value);
  put_u16(bytes, 0);
  put_u16(bytes, static_cast<std::uint16_t>(min_mbap_length + adu.pdu.data.size()));
  bytes.push_back(adu.unit.value);
  bytes.push_back(adu.pdu.function);
  bytes.insert(bytes.end(), adu.pdu.data.begin(), adu.pdu.data.end());
  return bytes;
}

Bytes frame_rtu(const Adu& adu) {
  Bytes bytes;
  bytes.reserve(rtu_head + adu.pdu.data.size() + crc_size);
  bytes.push_back(adu.unit.value);
  bytes.push_back(adu.pdu.function);
  bytes.insert(bytes.end(), adu.pdu.data.begin(), adu.pdu.data.end());
  const std::uint16_t crc = crc16(bytes);
  bytes.push_back(static_cast<std::uint8_t>(crc & 0xFFU));
  bytes.push_back(static_cast<std::uint8_t>(crc >> 8U));
  return bytes;
}

/// How the header's length and the bytes behind it fit together.
enum class Size : std::uint8_t { fits, open, impossible };

/// A frame that is longer than the standard's says so twice: its function is one of the
/// user-defined, and its data begin with their own length.
Size judge_long(ByteView buffered, std::size_t length) {
  if (length > max_mbap_length_of_long) return Size::impossible;
  if (buffered.size() <= mbap_size) return Size::open;
  if (!is_counted_by_words(buffered[mbap_size])) return Size::impossible;
  if (buffered.size() < long_head) return Size::open;
  return get_u16(buffered, mbap_size + 1) + min_mbap_length + 2 == length ? Size::fits
                                                                          : Size::impossible;
}

Size judge_size(ByteView buffered, std::size_t length) {
  if (length < min_mbap_length) return Size::impossible;
  return length <= max_mbap_length ? Size::fits : judge_long(buffered, length);
}

Deframing deframe_tcp(Role role, ByteView buffered) {
  // Only the low byte of the protocol identifier may be used by a tool for an id of its own.
  if (buffered.size() > 2 && buffered[2] != 0) {
    return Junk{buffered.size(),
                fmt::format("no Modbus TCP header: protocol identifier 0x{:02X}..", buffered[2])};
  }
  if (buffered.size() < mbap_length_end) return NeedMore{};
  const std::size_t length = get_u16(buffered, mbap_length_at);
  const bool is_long = length > max_mbap_length;
  const Size size =
      is_long && role == Role::server ? Size::impossible : judge_size(buffered, length);
  if (size == Size::open) return NeedMore{};
  if (size == Size::impossible) {
    return Junk{buffered.size(),
                fmt::format("no Modbus TCP header: length {} is not within {} to {}", length,
                            min_mbap_length, max_mbap_length)};
  }
  const std::size_t total = mbap_length_end + length;
  if (buffered.size() < total) return NeedMore{};
  const ByteView data = buffered.subspan(mbap_size + 1, total - mbap_size - 1);
  return Deframed{.adu = {.transaction = {get_u16(buffered, 0)},
                          .unit = {buffered[mbap_size - 1]},
                          .pdu = pdu_of(buffered[mbap_size], data)},
                  .consumed = total,
                  .skipped = 0,
                  .protocol = get_u16(buffered, 2)};
}

// Lengths are of whole frames, CRC included. Empty: no frame can begin like this. A result above
// bytes.size() may be a lower bound while the byte count has not arrived.
using Length = std::optional<std::size_t>;

// A frame whose data ends with a byte count at `count_at` and as many bytes.
Length counted_length(ByteView bytes, std::size_t count_at) {
  if (bytes.size() <= count_at) return count_at + 1;
  const std::size_t length = count_at + 1 + bytes[count_at] + crc_size;
  if (length > max_rtu_size) return std::nullopt;
  return length;
}

// The same with 16-bit items.
Length counted_words_length(ByteView bytes, std::size_t count_at) {
  if (bytes.size() > count_at && bytes[count_at] % 2 != 0) return std::nullopt;
  return counted_length(bytes, count_at);
}

constexpr std::size_t count_behind_head = rtu_head;
constexpr std::size_t count_behind_address = rtu_head + 4;
constexpr std::size_t two_words = rtu_head + 4 + crc_size;
constexpr std::size_t one_byte = rtu_head + 1 + crc_size;

Length request_length(FunctionCode function, ByteView bytes) {
  switch (function) {
    case FunctionCode::read_coils:
    case FunctionCode::read_discrete_inputs:
    case FunctionCode::read_holding_registers:
    case FunctionCode::read_input_registers:
    case FunctionCode::write_single_coil:
    case FunctionCode::write_single_register:
    case FunctionCode::diagnostics:
      return two_words;
    case FunctionCode::write_multiple_coils:
      return counted_length(bytes, count_behind_address);
    case FunctionCode::write_multiple_registers:
      return counted_words_length(bytes, count_behind_address);
    case FunctionCode::report_server_id:
      return rtu_head + crc_size;
  }
  return std::nullopt;
}

Length response_length(FunctionCode function, ByteView bytes) {
  switch (function) {
    case FunctionCode::read_holding_registers:
    case FunctionCode::read_input_registers:
      return counted_words_length(bytes, count_behind_head);
    case FunctionCode::write_single_coil:
    case FunctionCode::write_single_register:
    case FunctionCode::diagnostics:
    case FunctionCode::write_multiple_coils:
    case FunctionCode::write_multiple_registers:
      return two_words;
    case FunctionCode::read_coils:
    case FunctionCode::read_discrete_inputs:
    case FunctionCode::report_server_id:
      return counted_length(bytes, count_behind_head);
  }
  return std::nullopt;
}

bool is_spoken(FunctionCode function) { return request_length(function, {}).has_value(); }

// Bytes of 80h and above are common in data. Taking only exceptions to functions that are spoken
// here makes it unlikely that the inside of a half-received frame passes for an exception.
Length exception_length(FunctionCode function) {
  if (!is_spoken(function)) return std::nullopt;
  return one_byte;
}

Length rtu_length(Role role, ByteView bytes) {
  if (bytes.size() < rtu_head) return rtu_head;
  const std::uint8_t code = bytes[1];
  if (role == Role::server) return request_length(static_cast<FunctionCode>(code), bytes);
  if (code < exception_bit) return response_length(static_cast<FunctionCode>(code), bytes);
  return exception_length(static_cast<FunctionCode>(code - exception_bit));
}

bool crc_fits(ByteView bytes) {
  const std::size_t body = bytes.size() - crc_size;
  const std::uint16_t crc = crc16(bytes.first(body));
  return bytes[body] == (crc & 0xFFU) && bytes[body + 1] == (crc >> 8U);
}

Deframed rtu_frame_at(ByteView bytes, std::size_t skipped) {
  const ByteView data = bytes.subspan(rtu_head, bytes.size() - rtu_head - crc_size);
  return Deframed{.adu = {.transaction = {}, .unit = {bytes[0]}, .pdu = pdu_of(bytes[1], data)},
                  .consumed = skipped + bytes.size(),
                  .skipped = skipped,
                  .protocol = 0};
}

// Every offset may be the start: noise is skipped, also noise that looks like the beginning of a
// longer frame, because a frame that is complete and fits its CRC is better evidence.
Deframing deframe_rtu(Role role, ByteView buffered) {
  std::size_t first_hopeful = buffered.size();
  for (std::size_t offset = 0; offset < buffered.size(); ++offset) {
    const ByteView rest = buffered.subspan(offset);
    const Length length = rtu_length(role, rest);
    if (!length) continue;
    if (*length > rest.size()) {
      first_hopeful = std::min(first_hopeful, offset);
    } else if (crc_fits(rest.first(*length))) {
      return rtu_frame_at(rest.first(*length), offset);
    }
  }
  // No frame is longer than the limit, so beyond it the first offset is never hopeful.
  if (buffered.size() <= max_rtu_size) return NeedMore{};
  return Junk{first_hopeful, fmt::format("no frame in {} bytes", first_hopeful)};
}

}  // namespace

std::optional<Adu> whole_rtu_frame(ByteView bytes) {
  const bool possible = bytes.size() >= rtu_head + crc_size && bytes.size() <= max_rtu_size;
  if (!possible || !crc_fits(bytes)) return std::nullopt;
  return rtu_frame_at(bytes, 0).adu;
}

Bytes frame(Framing framing, const Adu& adu) {
  return framing == Framing::tcp ? frame_tcp(adu) : frame_rtu(adu);
}

Deframing deframe(Framing framing, Role role, ByteView buffered) {
  return framing == Framing::tcp ? deframe_tcp(role, buffered) : deframe_rtu(role, buffered);
}

}  // namespace spindle::modbus
