#include "spindle/sim/fault_plan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <string>

#include "spindle/base/duration.hpp"
#include "spindle/base/text.hpp"

namespace spindle::sim {
namespace {

enum class Argument : std::uint8_t { none, number, required_number, duration, transaction };

struct KindInfo {
  FaultKind kind;
  std::string_view name;
  Argument argument;
  std::uint16_t standard;  // number when none is given
  std::uint16_t minimum;
  std::uint16_t maximum;
  std::string_view syntax;
  std::string_view meaning;
};

constexpr std::uint16_t byte_limit = std::numeric_limits<std::uint8_t>::max();
constexpr std::uint16_t word_limit = std::numeric_limits<std::uint16_t>::max();
// More than a connection's buffers hold is of no use.
constexpr std::uint16_t size_limit = 4096;
// Extra registers or bytes that a header can still state beside the longest answer of a tool.
constexpr std::uint16_t extra_limit = 20;

constexpr std::array kinds = {
    KindInfo{FaultKind::latency, "latency", Argument::duration, 0, 0, 0, "latency=DURATION",
             "every answer takes this long; later ones wait for it"},
    KindInfo{FaultKind::lost, "lost", Argument::none, 0, 0, 0, "lost",
             "the request is carried out, but no answer comes"},
    KindInfo{FaultKind::late, "late", Argument::duration, 0, 0, 0, "late=DURATION",
             "the answer comes after this time; later ones do not wait for it"},
    KindInfo{FaultKind::repeated, "repeated", Argument::none, 0, 0, 0, "repeated",
             "the answer comes twice"},
    KindInfo{FaultKind::split, "split", Argument::number, 1, 1, size_limit, "split[=N]",
             "sent in pieces of N bytes (1), 1 ms apart"},
    KindInfo{FaultKind::glued, "glued", Argument::none, 0, 0, 0, "glued",
             "sent in one piece with the next frame, or after 50 ms"},
    KindInfo{FaultKind::half, "half", Argument::none, 0, 0, 0, "half",
             "only the first half of the answer, then nothing"},
    KindInfo{FaultKind::wrong_unit, "wrong-unit", Argument::number, 77, 0, byte_limit,
             "wrong-unit[=N]", "the answer carries unit identifier N (77)"},
    KindInfo{FaultKind::wrong_transaction, "wrong-transaction", Argument::number, 1, 1, word_limit,
             "wrong-transaction[=N]", "the answer's transaction id is N (1) too large (TCP)"},
    KindInfo{FaultKind::fixed_transaction, "fixed-transaction", Argument::number, 0, 0, word_limit,
             "fixed-transaction[=N]",
             "the answer's transaction id is N (0), whatever that of the request is (TCP)"},
    KindInfo{FaultKind::wrong_protocol, "wrong-protocol", Argument::number, 1, 0, word_limit,
             "wrong-protocol[=N]", "protocol identifier N (1) instead of 0 (TCP)"},
    KindInfo{FaultKind::wrong_echo, "wrong-echo", Argument::none, 0, 0, 0, "wrong-echo",
             "the echo of a write or of a loop-back names another value"},
    KindInfo{FaultKind::wrong_length, "wrong-length", Argument::number, 1, 1, extra_limit,
             "wrong-length[=N]",
             "N (1) registers more than asked for, header and count consistent"},
    KindInfo{FaultKind::wrong_header_length, "wrong-header-length", Argument::number, 2, 1,
             extra_limit, "wrong-header-length[=N]",
             "N (2) bytes behind the answer that only the header's length knows of (TCP)"},
    KindInfo{FaultKind::wrong_function, "wrong-function", Argument::number, 0x65, 0, byte_limit,
             "wrong-function[=N]", "the answer carries function code N (0x65)"},
    KindInfo{FaultKind::garbage, "garbage", Argument::number, 16, 1, size_limit, "garbage[=N]",
             "N (16) bytes that are no frame instead of the answer"},
    KindInfo{FaultKind::noise, "noise", Argument::number, 1, 1, size_limit, "noise[=N]",
             "N (1) bytes of noise before the answer"},
    KindInfo{FaultKind::echo, "echo", Argument::none, 0, 0, 0, "echo",
             "the client's adapter hears its own requests (RTU)"},
    KindInfo{FaultKind::foreign, "foreign", Argument::number, 78, 1, byte_limit, "foreign[=N]",
             "an answer of unit N (78) just before the right one (RTU)"},
    KindInfo{FaultKind::bad_crc, "bad-crc", Argument::none, 0, 0, 0, "bad-crc",
             "one bit of the checksum is wrong (RTU)"},
    KindInfo{FaultKind::exception, "exception", Argument::required_number, 0, 0, byte_limit,
             "exception=N", "nothing is carried out; exception response N is the answer"},
    KindInfo{FaultKind::push_before, "push-before", Argument::transaction, 0, 0, word_limit,
             "push-before[=ID|pending]",
             "an event frame with this transaction id before the answer"},
    KindInfo{FaultKind::push_inside, "push-inside", Argument::transaction, 0, 0, word_limit,
             "push-inside[=ID|pending]",
             "half an event frame, 1 ms later its rest together with the answer"},
    KindInfo{FaultKind::push_after, "push-after", Argument::transaction, 0, 0, word_limit,
             "push-after[=ID|pending]", "an event frame with this transaction id after the answer"},
    KindInfo{FaultKind::close, "close", Argument::none, 0, 0, 0, "close",
             "the request is carried out; the connection is closed instead of the answer"},
    KindInfo{FaultKind::close_inside, "close-inside", Argument::none, 0, 0, 0, "close-inside",
             "the connection is closed in the middle of the answer"},
    KindInfo{FaultKind::close_after, "close-after", Argument::none, 0, 0, 0, "close-after",
             "the connection is closed after the answer"},
    KindInfo{FaultKind::ignore_write, "ignore-write", Argument::none, 0, 0, 0, "ignore-write",
             "a write is echoed, but nothing is stored or done"},
    KindInfo{FaultKind::store_other, "store-other", Argument::number, 1, 1, word_limit,
             "store-other[=N]", "a write is echoed, but its value plus N (1) is stored"},
    KindInfo{FaultKind::reset_neighbour, "reset-neighbour", Argument::number, 1, 1, word_limit,
             "reset-neighbour[=N]",
             "a write is stored, and the register N (1) behind it becomes 0"},
    KindInfo{FaultKind::zero_date, "zero-date", Argument::none, 0, 0, 0, "zero-date",
             "an event has no date (firmware 4000 and later)"},
    KindInfo{FaultKind::not_a_number, "not-a-number", Argument::none, 0, 0, 0, "not-a-number",
             "the torque of an event is no number (firmware 4000 and later)"},
};

const KindInfo& info_of(FaultKind kind) {
  return *std::find_if(kinds.begin(), kinds.end(),
                       [kind](const KindInfo& row) { return row.kind == kind; });
}

Error bad(std::string_view text, std::string_view message, std::string hint) {
  return {.code = Errc::bad_value,
          .message = fmt::format("fault '{}': {}", text, message),
          .hint = std::move(hint)};
}

Error bad_argument(std::string_view text, const KindInfo& row) {
  if (row.argument == Argument::none) {
    return bad(text, fmt::format("{} takes no argument", row.name), "");
  }
  if (row.argument == Argument::duration) {
    return bad(text, fmt::format("{} needs a duration", row.name),
               fmt::format("write it like {}=500ms", row.name));
  }
  return bad(text,
             fmt::format("{} takes a number from {} to {}", row.name, row.minimum, row.maximum),
             fmt::format("write {}", row.syntax));
}

Result<const KindInfo*> find_kind(std::string_view text, std::string_view name) {
  const auto* const row = std::find_if(kinds.begin(), kinds.end(),
                                       [name](const KindInfo& info) { return info.name == name; });
  if (row != kinds.end()) return row;
  std::vector<std::string> names;
  names.reserve(kinds.size());
  for (const KindInfo& info : kinds) names.emplace_back(info.name);
  std::string hint = suggestion(name, names);
  if (hint.empty()) hint = "'spindle simulate --help' lists them";
  Error error = bad(text, "there is none of that name", std::move(hint));
  error.remedy.right = "spindle simulate --help";
  return tl::unexpected(std::move(error));
}

Result<void> parse_argument(Fault& fault, const KindInfo& row, std::string_view text,
                            std::string_view argument) {
  if (row.argument == Argument::none) return tl::unexpected(bad_argument(text, row));
  if (row.argument == Argument::duration) {
    const Result<Duration> duration = parse_duration(argument);
    if (!duration) return tl::unexpected(bad_argument(text, row));
    fault.duration = *duration;
    return {};
  }
  if (row.argument == Argument::transaction && argument == "pending") {
    fault.pending_transaction = true;
    return {};
  }
  const auto number = parse_unsigned(argument, row.maximum);
  if (!number || *number < row.minimum) return tl::unexpected(bad_argument(text, row));
  fault.number = static_cast<std::uint16_t>(*number);
  return {};
}

Result<void> parse_when(Fault& fault, std::string_view text, std::string_view when) {
  constexpr std::string_view every = "every:";
  const bool repeats = when.starts_with(every);
  const auto count = parse_unsigned(repeats ? when.substr(every.size()) : when,
                                    std::numeric_limits<std::uint32_t>::max());
  if (!count || *count == 0) {
    return tl::unexpected(bad(text, "behind '@' stands the number of an answer, from 1",
                              "write @3 for the third or @every:5 for every fifth"));
  }
  (repeats ? fault.every : fault.at) = static_cast<std::uint32_t>(*count);
  return {};
}

bool needs_argument(Argument argument) {
  return argument == Argument::duration || argument == Argument::required_number;
}

}  // namespace

bool Fault::applies_to(std::uint32_t answer_number) const {
  if (at == 0 && every == 0) return true;
  return (at != 0 && answer_number == at) || (every != 0 && answer_number % every == 0);
}

std::string_view to_text(FaultKind kind) { return info_of(kind).name; }

FaultNeed need_of(FaultKind kind) {
  switch (kind) {
    case FaultKind::wrong_transaction:
    case FaultKind::fixed_transaction:
    case FaultKind::wrong_protocol:
    case FaultKind::wrong_header_length:
      return FaultNeed::network;
    case FaultKind::echo:
    case FaultKind::foreign:
    case FaultKind::bad_crc:
      return FaultNeed::serial_line;
    case FaultKind::push_before:
    case FaultKind::push_inside:
    case FaultKind::push_after:
      return FaultNeed::events;
    case FaultKind::ignore_write:
    case FaultKind::store_other:
    case FaultKind::reset_neighbour:
      return FaultNeed::screwdriver;
    case FaultKind::zero_date:
    case FaultKind::not_a_number:
      return FaultNeed::dated;
    default:
      return FaultNeed::nothing;
  }
}

std::uint16_t number_of(const Fault& fault) {
  return fault.number.value_or(info_of(fault.kind).standard);
}

Result<Fault> parse_fault(std::string_view text) {
  const std::size_t at = text.find('@');
  const std::string_view what = text.substr(0, at);
  const std::size_t equals = what.find('=');

  TRY_LET(const auto row, find_kind(text, what.substr(0, equals)));
  Fault fault{.kind = row->kind};
  if (equals != std::string_view::npos) {
    auto parsed = parse_argument(fault, *row, text, what.substr(equals + 1));
    if (!parsed) return tl::unexpected(std::move(parsed.error()));
  } else if (needs_argument(row->argument)) {
    return tl::unexpected(bad_argument(text, *row));
  }
  if (at != std::string_view::npos) {
    auto parsed = parse_when(fault, text, text.substr(at + 1));
    if (!parsed) return tl::unexpected(std::move(parsed.error()));
  }
  return fault;
}

std::vector<FaultHelp> fault_help() {
  std::vector<FaultHelp> help;
  help.reserve(kinds.size());
  for (const KindInfo& row : kinds) {
    help.push_back({.kind = row.kind, .syntax = row.syntax, .meaning = row.meaning});
  }
  return help;
}

}  // namespace spindle::sim
