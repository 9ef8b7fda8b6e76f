#include "spindle/link/asked_line.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "spindle/modbus/adu.hpp"

namespace spindle::link {
namespace {

using modbus::ExceptionCode;
using modbus::FunctionCode;

// Modbus Application Protocol 1.1b3, section 6, beside those that spindle speaks itself.
constexpr std::uint8_t read_exception_status = 0x07;
constexpr std::uint8_t get_comm_event_counter = 0x0B;
constexpr std::uint8_t read_file_record = 0x14;
constexpr std::uint8_t read_fifo_queue = 0x18;
constexpr std::uint8_t encapsulated = 0x2B;
constexpr std::uint8_t read_device_identification = 0x0E;

bool is_spoken(std::uint8_t function) {
  switch (static_cast<FunctionCode>(function)) {
    case FunctionCode::read_coils:
    case FunctionCode::read_discrete_inputs:
    case FunctionCode::read_holding_registers:
    case FunctionCode::read_input_registers:
    case FunctionCode::write_single_coil:
    case FunctionCode::write_single_register:
    case FunctionCode::diagnostics:
    case FunctionCode::write_multiple_coils:
    case FunctionCode::write_multiple_registers:
    case FunctionCode::report_server_id:
      return true;
  }
  return false;
}

/// Whether a request changes nothing. What is not known here may change something.
bool only_reads(const modbus::Pdu& request) {
  const auto function = static_cast<FunctionCode>(request.function);
  if (modbus::is_read(request.function) || function == FunctionCode::report_server_id) return true;
  if (function == FunctionCode::diagnostics) {
    return request.data.size() >= 2 && get_u16(request.data, 0) == 0;
  }
  if (request.function == encapsulated) {  // the other kinds can carry anything
    return !request.data.empty() && request.data.front() == read_device_identification;
  }
  return request.function == read_exception_status || request.function == get_comm_event_counter ||
         request.function == read_file_record || request.function == read_fifo_queue;
}

/// Nothing of the tool came, and nothing can.
bool is_without_link(const Error& error) {
  return error.code != Errc::no_answer && error.code != Errc::incomplete_answer &&
         error.code != Errc::malformed_answer && error.code != Errc::bad_checksum &&
         error.code != Errc::local_echo;
}

bool is_ending(const Error& error) {
  return error.code == Errc::interrupted || error.code == Errc::terminated;
}

/// The read in two, where its answer would look like what the tool sends unasked.
std::vector<modbus::ReadRequest> parts_of(const modbus::Pdu& request, const DemuxRules& rules) {
  const auto parsed = modbus::parse_request(request);
  const auto* read = parsed ? std::get_if<modbus::ReadRequest>(&*parsed) : nullptr;
  if (read == nullptr || read->count < 2 || modbus::holds_bits(read->table)) return {};
  const bool is_taken = std::any_of(
      rules.spontaneous.begin(), rules.spontaneous.end(), [&](const SpontaneousShape& shape) {
        return shape.function == request.function && shape.byte_count == 2 * read->count;
      });
  if (!is_taken) return {};
  const auto most = static_cast<std::uint16_t>(read->count - 1);
  return {{read->table, read->first, most},
          {read->table, {static_cast<std::uint16_t>(read->first.value + most)}, 1}};
}

}  // namespace

AskedLine::AskedLine(SharedLine& line, Peer peer, Clock& clock)
    : line_(&line), peer_(std::move(peer)), clock_(&clock) {}

bool AskedLine::take(ByteView packet) {
  if (peer_.kind == Peer::Kind::spindle && is_owner_note(packet)) {
    const auto note = decode_owner_note(packet);
    return note && take_note(*note);
  }
  const auto request = one_frame(packet);
  return request && answer(*request);
}

bool AskedLine::take_note(const OwnerNote& note) {
  if (std::holds_alternative<Hello>(note)) {
    return peer_.answer(encode(Welcome{.serial = is_serial(), .trouble = line_->trouble()}));
  }
  if (const auto* manner = std::get_if<Manner>(&note)) {
    learn(*manner);
    return true;
  }
  if (const auto* haste = std::get_if<Haste>(&note)) {
    haste_ = *haste;
    return true;
  }
  return false;
}

/// A session that was made before goes on as it is told now.
void AskedLine::learn(const Manner& manner) {
  const SessionOptions& options = manner.options;
  manners_.insert_or_assign(options.unit, options);
  sessions_.erase(options.unit);
  ear_.reset();
  if (options.rules.spontaneous.empty() || !peer_.tell) return;
  ear_ = line_->listen([tell = peer_.tell, wanted = options.rules](ByteView frame) {
    const auto heard = modbus::deframe(modbus::Framing::tcp, modbus::Role::client, frame);
    const auto* whole = std::get_if<modbus::Deframed>(&heard);
    if (whole != nullptr && judge(nullptr, whole->adu, wanted) == Verdict::spontaneous) tell(frame);
  });
}

bool AskedLine::is_serial() const {
  const auto known = line_->manner_with({});
  return known && known->rules.framing == modbus::Framing::rtu;
}

bool AskedLine::answer_with(const modbus::Adu& request, modbus::Pdu pdu) {
  return peer_.answer(modbus::frame(
      modbus::Framing::tcp,
      {.transaction = request.transaction, .unit = request.unit, .pdu = std::move(pdu)}));
}

/// What is wrong with a request itself never reaches the line.
std::optional<ExceptionCode> AskedLine::refusal(const modbus::Pdu& request) const {
  if (peer_.rights == Rights::read && !only_reads(request)) return ExceptionCode::illegal_function;
  if (!is_spoken(request.function)) {
    // Of an answer on a serial line nothing else says where it ends.
    return is_serial() ? std::optional(ExceptionCode::illegal_function) : std::nullopt;
  }
  const auto parsed = modbus::parse_request(request);
  return parsed ? std::nullopt : std::optional(parsed.error());
}

bool AskedLine::answer(const modbus::Adu& request) {
  const bool is_to_all = request.unit == modbus::UnitId{} && is_serial();
  if (const auto code = refusal(request.pdu)) {
    if (is_to_all) return true;
    return answer_with(request, modbus::exception_response(request.pdu.function,
                                                           static_cast<std::uint8_t>(*code)));
  }
  if (is_to_all) return broadcast(request);
  auto answered = ask(request.unit, request.pdu);
  if (answered) return answer_with(request, std::move(*answered));
  return tell_trouble(request, answered.error());
}

bool AskedLine::tell_trouble(const modbus::Adu& request, const Error& error) {
  if (is_ending(error)) return false;
  if (peer_.kind == Peer::Kind::spindle) {
    return peer_.answer(encode(Unanswered{.request = request.transaction, .error = error}));
  }
  const auto code = is_without_link(error) ? ExceptionCode::gateway_path_unavailable
                                           : ExceptionCode::gateway_target_failed_to_respond;
  return answer_with(
      request, modbus::exception_response(request.pdu.function, static_cast<std::uint8_t>(code)));
}

/// No unit answers, so only a spindle learns that it was sent.
bool AskedLine::broadcast(const modbus::Adu& request) {
  auto sent = session_for(request.unit).and_then([&](Session* session) {
    return session->broadcast(request.pdu);
  });
  if (peer_.kind == Peer::Kind::any) return true;
  if (!sent) return tell_trouble(request, sent.error());
  return peer_.answer(encode(Unanswered{.request = request.transaction}));
}

SessionOptions AskedLine::options_for(modbus::UnitId unit) const {
  const SessionOptions own = line_->manner_with(unit).value_or(SessionOptions());
  const auto told = manners_.find(unit);
  SessionOptions options = told == manners_.end() ? own : told->second;
  options.unit = unit;
  options.rules.framing = own.rules.framing;
  options.in_use_until = clock_->now();
  for (const SpontaneousShape& shape : own.rules.spontaneous) {
    options.rules.spontaneous.push_back(shape);
  }
  return options;
}

Result<Session*> AskedLine::session_for(modbus::UnitId unit) {
  const std::size_t opening = line_->opening();
  auto known = sessions_.find(unit);
  if (known == sessions_.end() || known->second.opening != opening) {
    sessions_.erase(unit);
    TRY_LET(auto share, line_->join_open());
    auto session = std::make_unique<Session>(std::move(share), *clock_, options_for(unit));
    session->on_spontaneous([](const Spontaneous&) {});  // heard by the ear
    known = sessions_.emplace(unit, Asked{std::move(session), opening}).first;
  }
  Session& session = *known->second.session;
  if (haste_.answer_timeout > Duration::zero()) session.set_answer_timeout(haste_.answer_timeout);
  if (haste_.urgent) session.set_urgent();
  if (haste_.unverified) session.skip_verification();
  return &session;
}

Result<modbus::Pdu> AskedLine::ask(modbus::UnitId unit, const modbus::Pdu& request) {
  TRY_LET(Session * session, session_for(unit));
  const auto parts = parts_of(request, session->options().rules);
  if (parts.empty()) return ask_believed(*session, request);
  Registers registers;
  for (const modbus::ReadRequest& part : parts) {
    const auto asked = modbus::read_request(part.table, part.first, part.count);
    TRY_LET(auto answered, ask_believed(*session, asked));
    if (modbus::exception_of(answered)) return answered;
    const Registers more = modbus::registers_of(answered);
    registers.insert(registers.end(), more.begin(), more.end());
  }
  return modbus::read_response(parts.front().table, registers);
}

/// A read once more, in doubt this time, where it turns out that others are on the line.
Result<modbus::Pdu> AskedLine::ask_believed(Session& session, const modbus::Pdu& request) {
  if (!modbus::is_read(request.function)) return session.transact(request);
  const Session::Mark mark = session.mark();
  auto answered = session.transact(request);
  if (!answered) return answered;
  TRY_LET(const bool undisturbed, session.is_undisturbed_since(mark));
  return undisturbed ? std::move(answered) : session.transact(request);
}

}  // namespace spindle::link
