#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "spindle/base/clock.hpp"

namespace spindle::sim {

/// Ways in which an answer (or a tool) misbehaves. Each was seen on real devices, gateways or
/// servers, or is what a hostile test wants. The text form is the enumerator with '-' for '_'.
enum class FaultKind : std::uint8_t {
  latency,              ///< DURATION before the answer; of several the longest counts
  lost,                 ///< no answer at all
  late,                 ///< the answer comes after DURATION; later answers do not wait for it
  repeated,             ///< the answer comes twice
  split,                ///< sent in pieces of N bytes (default 1), 1 ms apart
  glued,                ///< kept back and sent in one piece with the next frame (or after 50 ms)
  half,                 ///< only the first half of the frame, then nothing
  wrong_unit,           ///< unit identifier N (default 77)
  wrong_transaction,    ///< transaction id plus N (default 1)
  fixed_transaction,    ///< transaction id N (default 0)
  wrong_protocol,       ///< MBAP protocol identifier N (default 1)
  wrong_echo,           ///< a write's echo names another value; a read's data is untouched
  wrong_length,         ///< byte count and data N (default 1) registers too long, header consistent
  wrong_header_length,  ///< MBAP length N (default 2) larger than the frame, with N extra bytes
  wrong_function,       ///< another function code: N (default 0x65)
  garbage,              ///< N (default 16) bytes that are no frame instead of the answer
  noise,                ///< N (default 1) bytes before the answer
  echo,                 ///< RTU: the adapter hears what the client sends, before any answer
  foreign,      ///< RTU: just before the answer, one of unit N (default 78) of the same shape
  bad_crc,      ///< RTU: one bit of the checksum flipped
  exception,    ///< exception response N instead of the answer
  push_before,  ///< an event frame with transaction id N just before the answer; "pending" = the
                ///< request's own; neither = the tool's own count
  push_inside,  ///< first half of an event frame, then after 1 ms its rest together with the answer
  push_after,   ///< an event frame just after the answer
  close,        ///< connection closed instead of the answer
  close_inside,     ///< connection closed in the middle of the answer
  close_after,      ///< connection closed after the answer
  ignore_write,     ///< a write is echoed, but nothing is stored
  store_other,      ///< a write is echoed, but value + N (default 1) is stored
  reset_neighbour,  ///< a write is stored, and the register N (default 1) behind it becomes 0
  zero_date,        ///< an event has no date
  not_a_number,     ///< the torque of an event, and the present one behind it, is no number
};

/// One fault: kind, argument, and when. Counts answers of the whole server from 1; with neither
/// `at` nor `every` it is always on.
struct Fault {
  FaultKind kind = FaultKind::latency;
  std::optional<std::uint16_t> number = std::nullopt;
  std::optional<Duration> duration = std::nullopt;
  bool pending_transaction = false;  ///< push_*: copy the id of the request being answered
  std::uint32_t at = 0;              ///< only the answer with this number
  std::uint32_t every = 0;           ///< every answer whose number is divisible by this

  [[nodiscard]] bool applies_to(std::uint32_t answer_number) const;
};

using FaultPlan = std::vector<Fault>;

/// "wrong-unit": the kind as parse_fault() reads it.
std::string_view to_text(FaultKind kind);

/// What a simulated tool must have for a fault to be felt at all.
enum class FaultNeed : std::uint8_t {
  nothing,
  network,      ///< the header of Modbus TCP
  serial_line,  ///< RTU
  events,       ///< frames that the tool sends unasked
  screwdriver,  ///< a tool that an operator works with, see Abilities
  dated,        ///< events that have a date, and torques that are floating-point
};
FaultNeed need_of(FaultKind kind);

/// The fault's number, else the default of its kind (0 where it has none).
std::uint16_t number_of(const Fault& fault);

/// Reads "KIND[=ARGUMENT][@K|@every:N]", such as "late=1500ms@3", "lost@every:5",
/// "push-before=0x0001", "push-before=pending", "split". Error `bad_value` with a suggestion; a
/// duration or number that the kind does not take, or lacks, is an error.
Result<Fault> parse_fault(std::string_view text);

/// All kinds with their argument, one line each, for help and manual.
struct FaultHelp {
  FaultKind kind;
  std::string_view syntax;
  std::string_view meaning;
};
std::vector<FaultHelp> fault_help();

}  // namespace spindle::sim
