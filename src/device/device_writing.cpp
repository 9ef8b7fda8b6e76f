#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "device/register_range.hpp"
#include "spindle/base/text.hpp"
#include "spindle/device/command_word.hpp"
#include "spindle/device/device.hpp"

namespace spindle::device {
namespace {

/// How often a confirming parameter is read while its effect is awaited.
constexpr Duration confirm_interval = std::chrono::milliseconds(20);

/// How often the status is read while the tool works by itself.
constexpr Duration busy_interval = std::chrono::milliseconds(50);

using catalogue::Parameter;
using catalogue::Value;
using modbus::FunctionCode;

/// What an action writes, as a parameter that can be encoded.
Parameter as_parameter(const catalogue::Action& action) {
  Parameter parameter;
  parameter.name = action.name;
  parameter.table = action.table;
  parameter.address = action.address;
  parameter.encoding = action.encoding;
  return parameter;
}

/// The requests that write these registers or coils, as the profile wants them.
std::vector<modbus::Pdu> write_requests(modbus::RegisterTable table, modbus::RegisterAddress first,
                                        const Registers& registers,
                                        const catalogue::LinkSpec& link) {
  if (table == modbus::RegisterTable::coil) {
    return {registers.size() == 1 ? modbus::write_coil_request(first, registers.front())
                                  : modbus::write_coils_request(first, RegisterView(registers))};
  }
  constexpr auto several = static_cast<std::uint8_t>(FunctionCode::write_multiple_registers);
  const bool may_be_whole =
      link.write_function ? *link.write_function == several : registers.size() > 1;
  if (may_be_whole && registers.size() <= std::max<std::size_t>(link.max_write, 1)) {
    return {modbus::write_request(first, RegisterView(registers))};
  }
  std::vector<modbus::Pdu> requests;
  for (const std::uint16_t& word : registers) {
    requests.push_back(link.write_function == several
                           ? modbus::write_request(first, RegisterView(&word, 1))
                           : modbus::write_request(first, word));
    ++first.value;
  }
  return requests;
}

/// The first pause between two readings of a value that does not read right yet; it doubles.
constexpr Duration first_settling_pause = std::chrono::milliseconds(10);

/// The first pause before a write is sent again to a tool that answered "busy"; it doubles.
constexpr Duration first_busy_pause = std::chrono::milliseconds(50);

bool is_exception(const Error& error, modbus::ExceptionCode code) {
  return error.exception == static_cast<std::uint8_t>(code);
}

/// After a write: a missing or broken answer leaves open what the tool did, and so does a gateway
/// that waited for it in vain, and a connection that ended.
bool is_lost(const Error& error) {
  return link::is_lost_answer(error) || error.code == Errc::closed || error.code == Errc::reset ||
         is_exception(error, modbus::ExceptionCode::gateway_target_failed_to_respond);
}

/// Whether the tool can be asked what became of a write that failed so.
bool can_be_read_back(const Error& error) {
  return is_lost(error) || error.code == Errc::exception_response;
}

/// The tool says of a write or a reading that it will come to it later.
bool is_postponed(const Error& error) {
  return is_exception(error, modbus::ExceptionCode::acknowledge) ||
         is_exception(error, modbus::ExceptionCode::server_device_busy);
}

/// Whether the server has done nothing yet, and is to be asked again.
bool is_busy(const Error& error, const catalogue::LinkSpec& link) {
  if (link.busy.empty()) return is_exception(error, modbus::ExceptionCode::server_device_busy);
  return error.exception &&
         std::find(link.busy.begin(), link.busy.end(), *error.exception) != link.busy.end();
}

bool is_interruption(const Error& error) {
  return error.code == Errc::interrupted || error.code == Errc::terminated;
}

/// The tool acknowledged a deed, and only the proof is missing: a refused reading must not look
/// like a refused write.
Error without_proof(Error reading) {
  if (is_interruption(reading)) return reading;
  reading.message =
      fmt::format("the tool acknowledged it, but reading it back failed: {}", message_of(reading));
  if (reading.code == Errc::exception_response) reading.code = Errc::mismatch;
  return reading;
}

/// It is not known what became of a write without an answer that cannot be read back either.
Error without_knowledge(Error write, const Parameter& parameter, const Value& before,
                        const Value& value) {
  if (is_interruption(write)) return write;
  write.hint = fmt::format("whether it was written is not known: it holds {} or {}; read it again",
                           shown_of(parameter, before), shown_of(parameter, value));
  return write;
}

}  // namespace

bool is_refusal(const Error& error) {
  return error.code == Errc::exception_response && !is_postponed(error) &&
         !is_exception(error, modbus::ExceptionCode::gateway_path_unavailable) &&
         !is_exception(error, modbus::ExceptionCode::gateway_target_failed_to_respond);
}

/// A product that takes one register a request gets the words of a pair one after the other, in the
/// order of their registers.
Result<void> Device::write_registers(modbus::RegisterTable table, modbus::RegisterAddress first,
                                     const Registers& registers) {
  TRY(profile_->may_write(table, first, registers.size()));
  for (const modbus::Pdu& request : write_requests(table, first, registers, profile_->link)) {
    TRY(client_.write(request));
  }
  return {};
}

/// A tool that refuses because it is busy has done nothing, so it is asked again for a while.
Result<void> Device::while_busy(const std::function<Result<void>()>& write) {
  const auto& refusals = profile_->refusals;
  const TimePoint limit = clock().now() + (refusals ? refusals->give_up_after : Duration::zero());
  while (true) {
    Result<void> written = write();
    const bool busy = !written && refusals && written.error().device_code &&
                      refusals->is_busy(*written.error().device_code);
    if (!busy) return written;
    const TimePoint next = clock().now() + refusals->retry_every;
    if (next > limit) return written;
    TRY(clock().sleep_until(next));
  }
}

Result<void> Device::send_write(const Parameter& parameter, const Registers& registers) {
  const modbus::RegisterAddress first = parameter.written_at();
  return while_busy([&] { return write_registers(parameter.table, first, registers); })
      .map_error(
          [&](Error error) { return about(std::move(error), parameter.name, parameter.address); });
}

/// By the standard a busy tool (06) is to be asked again later, and has done nothing yet.
Result<void> Device::send_while_busy(const Parameter& parameter, const Value& value,
                                     Registers registers) {
  const catalogue::LinkSpec& link = profile_->link;
  const TimePoint limit =
      clock().now() + (link.busy.empty() ? session_->options().answer_timeout : link.busy_limit);
  Duration pause = link.busy.empty() ? first_busy_pause : link.busy_every;
  while (true) {
    auto sent = send_write(parameter, registers);
    const TimePoint next = clock().now() + pause;
    if (sent || !is_busy(sent.error(), link) || next > limit) return sent;
    TRY(clock().sleep_until(next));
    if (link.busy.empty()) pause *= 2;
    if (!parameter.encoding.is_part()) continue;
    auto now = registers_for(parameter, value);  // what stands beside it may have changed
    if (!now) return tl::unexpected(std::move(now.error()));
    registers = std::move(*now);
  }
}

/// As soon as it reads as expected, or whatever it is when the time is over. A tool that answers
/// the reading with "busy" is asked again.
Result<Value> Device::settled(const Parameter& parameter, const Value& expected, Duration limit,
                              Proof proof) {
  const TimePoint deadline = clock().now() + limit;
  if (proof == Proof::after_settling) {
    TRY(clock().sleep_until(deadline));
  }
  Duration pause = first_settling_pause;
  while (true) {
    auto now = read_value(parameter);
    const bool final = now ? *now == expected : !is_postponed(now.error());
    const TimePoint at = clock().now();
    if (final || at >= deadline) return now;
    TRY(clock().sleep_until(std::min(at + pause, deadline)));
    pause *= 2;
  }
}

/// The tool says that it did nothing. Half of a pair may have been written all the same, and a tool
/// that failed at it (04) may have failed in the middle.
Written Device::refused(Error error, const Parameter& parameter, const Value& before,
                        const Value& value) {
  const bool pair = catalogue::register_count(parameter.encoding) > 1;
  const bool failed =
      is_exception(error, modbus::ExceptionCode::server_device_failure) && !error.device_code;
  if (!pair && !failed) return {WriteResult::refused, before, std::move(error)};
  const auto now = read_value(parameter);
  if (!now) {
    error.message += "; what it holds now could not be read";
    return {WriteResult::unknown, std::nullopt, std::move(error), Doubt::may_act_late};
  }
  if (*now == before) return {WriteResult::refused, *now, std::move(error)};
  if (*now == value) return {WriteResult::written, *now};
  error.message += fmt::format("; it was written in part and holds {}", shown_of(parameter, *now));
  return {WriteResult::coerced, *now, std::move(error)};
}

Written Device::judged(const Parameter& parameter, const Value& before, const Value& value,
                       const Result<void>& sent, const Result<Value>& now) const {
  if (!now) {
    const bool by_reading = sent || is_interruption(now.error());
    return {WriteResult::unknown, std::nullopt,
            by_reading ? without_proof(now.error())
                       : without_knowledge(sent.error(), parameter, before, value),
            Doubt::may_act_late};
  }
  if (*now == value) return {WriteResult::written, *now};
  const bool same = *now == before;
  const std::string holds =
      fmt::format("{} holds {}", same ? "still" : "now", shown_of(parameter, *now));
  Error error;
  if (sent) {
    error = about({.code = Errc::mismatch,
                   .message = fmt::format("the tool acknowledged {} but {}",
                                          shown_of(parameter, value), holds),
                   .hint = "is the tool running, locked, or set to refuse changes?"},
                  parameter.name, parameter.address);
  } else {
    error = sent.error();
    error.message = fmt::format("{}; it {}", message_of(error), holds);
  }
  const bool rejected =
      !sent && (is_exception(error, modbus::ExceptionCode::server_device_busy) ||
                is_exception(error, modbus::ExceptionCode::gateway_path_unavailable));
  const WriteResult kept = rejected ? WriteResult::refused : WriteResult::mismatch;
  return {same ? kept : WriteResult::coerced, *now, std::move(error), Doubt::may_act_late};
}

/// The registers of a value; those of which only some bits are its own are read first.
Result<Registers> Device::registers_for(const Parameter& parameter, const Value& value) {
  TRY(catalogue::check_pair(parameter.encoding, profile_->link));
  if (!parameter.encoding.is_part()) return catalogue::encode(parameter, value);
  const auto present = client_.read(range_of(parameter));
  if (!present) return present;
  return catalogue::encode(parameter, value, *present);
}

Written Device::write(const Parameter& parameter, const Value& before, const Value& value,
                      Proof proof) {
  const auto locked = unlock_for(parameter);
  if (!locked) {
    return {WriteResult::refused, before, about(locked.error(), parameter.name, parameter.address)};
  }
  Written written = write_unlocked(parameter, before, value, proof);
  if (!*locked) return written;
  const auto put_back = lock_again(**locked);
  if (put_back) return written;
  if (written.error) {
    written.error->message = not_put_back(message_of(*written.error), put_back.error());
    return written;
  }
  Error error = about(put_back.error(), parameter.name, parameter.address);
  error.message = not_put_back("it was written", put_back.error());
  return {WriteResult::unknown, written.now, std::move(error)};
}

Written Device::write_unlocked(const Parameter& parameter, const Value& before, const Value& value,
                               Proof proof) {
  auto registers = registers_for(parameter, value);
  if (!registers) {
    return {WriteResult::refused, before,
            about(std::move(registers.error()), parameter.name, parameter.address)};
  }
  const Duration settling = parameter.settle.value_or(profile_->link.settle);
  auto sent = send_while_busy(parameter, value, *registers);
  if (!sent && is_refusal(sent.error())) {
    return refused(std::move(sent.error()), parameter, before, value);
  }
  if (!sent && !can_be_read_back(sent.error())) {
    return judged(parameter, before, value, sent, tl::unexpected(sent.error()));
  }
  const bool works_on_it = !sent && is_exception(sent.error(), modbus::ExceptionCode::acknowledge);
  auto now = settled(
      parameter, value,
      works_on_it ? std::max(settling, session_->options().answer_timeout) : settling, proof);
  const bool did_not_take =
      !sent && is_lost(sent.error()) && now && *now == before && !(*now == value);
  if (did_not_take) {
    if (parameter.encoding.is_part()) registers = registers_for(parameter, value);
    if (!registers) return judged(parameter, before, value, sent, now);
    sent = send_while_busy(parameter, value, *registers);
    if (sent || can_be_read_back(sent.error())) now = settled(parameter, value, settling, proof);
  }
  return judged(parameter, before, value, sent, now);
}

/// Writes what others have to wait for. Returns what it held; empty: nothing was written.
Result<std::optional<Device::Lock>> Device::unlock_for(const Parameter& parameter) {
  const auto& unlock = profile_->unlock;
  if (!unlock || parameter.name == unlock->parameter.view()) return std::nullopt;
  const auto& needed = unlock->needed_by;
  const bool is_needed =
      needed.empty() || std::any_of(needed.begin(), needed.end(), [&](const auto& pattern) {
        return glob_match(pattern, parameter.name);
      });
  if (!is_needed) return std::nullopt;
  TRY_LET(auto lock, profile_->find(unlock->parameter));
  TRY_LET(const auto before, read_value(lock));
  const Value key{Decimal(unlock->value)};
  if (before == key) return std::nullopt;
  const Written written = write_unlocked(lock, before, key, Proof::first_right);
  if (written.done()) return Lock{std::move(lock), before};
  Error error = *written.error;
  const bool is_open = written.may_have_changed();
  if (const auto put_back = is_open ? lock_again({lock, before}) : Result<void>(); !put_back) {
    error.message = not_put_back(message_of(error), put_back.error());
  }
  return tl::unexpected(std::move(error));
}

Result<void> Device::lock_again(const Lock& lock) {
  const Value key{Decimal(profile_->unlock->value)};
  Written written = write_unlocked(lock.parameter, key, lock.before, Proof::first_right);
  const bool was_stopped = written.error && (written.error->code == Errc::interrupted ||
                                             written.error->code == Errc::terminated);
  if (was_stopped) {  // the command ends, but not with a tool that is open
    session_->set_uninterruptible();
    written = write_unlocked(lock.parameter, key, lock.before, Proof::first_right);
  }
  if (written.done()) return {};
  return tl::unexpected(*written.error);
}

std::string Device::not_put_back(std::string_view what, const Error& why) const {
  return fmt::format("{}, but {} could not be put back: {}", what, profile_->unlock->parameter,
                     message_of(why));
}

void Device::shield(Clock& calm) {
  session_->set_uninterruptible();
  calm_ = &calm;
}

Result<void> Device::send(const catalogue::Action& action, std::int64_t value) {
  TRY_LET(const auto registers, catalogue::encode(as_parameter(action), {Decimal(value)}));
  TRY(catalogue::check_pair(action.encoding, profile_->link));
  return while_busy([&] { return write_registers(action.table, action.address, registers); })
      .map_error([&](Error error) { return about(std::move(error), action.name, action.address); });
}

Result<void> Device::send(const Parameter& parameter, const Decimal& number) {
  TRY_LET(const auto registers, registers_for(parameter, {number}));
  const auto first = parameter.written_at();
  return write_registers(parameter.table, first, registers).map_error([&](Error error) {
    return about(std::move(error), parameter.name, parameter.address);
  });
}

Result<void> Device::write_word(modbus::RegisterAddress address, std::uint16_t word) {
  return write_registers(modbus::RegisterTable::holding, address, {word})
      .map_error([this](Error error) { return located(std::move(error)); });
}

Result<Shown> Device::shows(const std::string& parameter, std::int64_t number) {
  TRY_LET(const auto found, profile_->find(parameter));
  return read_value(found).map(
      [&](const Value& value) { return value.number == Decimal(number) ? Shown::yes : Shown::no; });
}

Result<ActionResult> Device::perform(const catalogue::Action& action, std::int64_t value) {
  if (action.confirm.empty()) return carry_out(action, value);
  TRY_LET(const auto confirming, profile_->find(action.confirm));
  const Value expected{Decimal(action.confirm_value.value_or(value))};
  if (action.prepare) {
    TRY_LET(const auto now, read_value(confirming));
    if (now == expected) return ActionResult::confirmed;
  }
  auto done = carry_out(action, value);
  if (!done && can_be_read_back(done.error()) && !is_refusal(done.error())) {
    return found_done(action, confirming, expected, std::move(done.error()));
  }
  if (!done || *done == ActionResult::not_confirmed) return done;
  return confirm(action, confirming, expected);
}

/// The answer does not say what became of it, and it is never sent again: its effect does.
Result<ActionResult> Device::found_done(const catalogue::Action& action,
                                        const Parameter& confirming, const Value& expected,
                                        Error error) {
  const auto found = confirm(action, confirming, expected);
  if (found == ActionResult::confirmed) return found;
  if (!found && is_interruption(found.error())) return found;
  error.hint = found ? fmt::format("{} does not show the effect", confirming.name)
                     : fmt::format("whether it was done is not known: {} could not be read",
                                   confirming.name);
  return tl::unexpected(std::move(error));
}

/// What there is to do: nothing is known of the effect but that the tool is ready again.
Result<ActionResult> Device::carry_out(const catalogue::Action& action, std::int64_t value) {
  if (action.prepare) {
    if (auto prepared = prepare(*action.prepare); !prepared) {
      return tl::unexpected(about(std::move(prepared.error()), action.name, action.address));
    }
  }
  auto sent = action.rest ? send(action, *action.rest) : Result<void>();
  if (sent) sent = send(action, value);
  if (!sent) return tl::unexpected(std::move(sent.error()));
  auto ready = await_ready(action.busy);
  if (ready && action.rest) {
    sent = send(action, *action.rest);
    if (!sent) return tl::unexpected(std::move(sent.error()));
    ready = await_ready(action.busy);
  }
  if (!ready) return tl::unexpected(without_proof(std::move(ready.error())));
  if (*ready == Shown::no) return ActionResult::not_confirmed;
  return action.busy > Duration::zero() ? ActionResult::finished : ActionResult::sent;
}

Result<ActionResult> Device::confirm(const catalogue::Action& action, const Parameter& confirming,
                                     const Value& expected) {
  const TimePoint deadline = clock().now() + session_->options().answer_timeout;
  while (true) {
    auto now = read_value(confirming);
    if (!now) {
      now.error().name = action.name;
      return tl::unexpected(without_proof(std::move(now.error())));
    }
    if (*now == expected) return ActionResult::confirmed;
    const TimePoint next = clock().now() + confirm_interval;
    if (next > deadline) return ActionResult::not_confirmed;
    TRY(clock().sleep_until(next));
  }
}

/// On a driver whose inputs are assigned otherwise other bits do the same; all of them where that
/// cannot be known.
std::uint16_t Device::bits_to_clear(const catalogue::Preparation& preparation) {
  const auto motor = CommandWord::of(*profile_);
  const bool varies =
      motor && motor->has_inputs() && motor->command_register() == preparation.address;
  if (!varies) return preparation.clear;
  const auto bits = motor->read_bits(*this, std::numeric_limits<std::uint16_t>::max());
  return bits ? bits->any_of(preparation.clear) : std::numeric_limits<std::uint16_t>::max();
}

Result<void> Device::prepare(const catalogue::Preparation& preparation) {
  TRY_LET(const auto words,
          read_raw({modbus::RegisterTable::holding, preparation.address.value, 1}));
  const std::uint16_t word = words.front();
  const auto cleared = static_cast<std::uint16_t>(word & ~unsigned{bits_to_clear(preparation)});
  if (cleared == word) return {};
  return while_busy([&] {
    return write_registers(modbus::RegisterTable::holding, preparation.address, {cleared});
  });
}

/// Until the status says that the tool does no longer work by itself; no limit: it never does.
Result<Shown> Device::await_ready(Duration limit) {
  if (limit == Duration::zero()) return Shown::yes;
  const auto model = RunModel::of(*profile_);
  const MotorMonitor* monitor = model ? (*model)->monitor() : nullptr;
  if (monitor == nullptr) return Shown::yes;
  TRY_LET(const auto status, profile_->find(monitor->facts().status));
  const TimePoint deadline = clock().now() + limit;
  while (true) {
    TRY_LET(const auto word, read_value(status));
    if (!monitor->is_busy(word.number)) return Shown::yes;
    const TimePoint next = clock().now() + busy_interval;
    if (next > deadline) return Shown::no;
    TRY(clock().sleep_until(next));
  }
}

// ---- everybody ----

Result<void> Device::broadcast_word(modbus::RegisterAddress address, std::uint16_t word) {
  return broadcast_registers(modbus::RegisterTable::holding, address, {word});
}

Result<void> Device::broadcast_registers(modbus::RegisterTable table, modbus::RegisterAddress first,
                                         const Registers& registers) {
  TRY(profile_->may_write(table, first, registers.size()));
  for (const modbus::Pdu& request : write_requests(table, first, registers, profile_->link)) {
    auto sent = session_->broadcast(request);
    if (!sent) return tl::unexpected(located(std::move(sent.error())));
  }
  return {};
}

Result<void> Device::broadcast(const Parameter& parameter, const Value& value) {
  TRY_LET(const auto registers, catalogue::encode(parameter, value));
  TRY(catalogue::check_pair(parameter.encoding, profile_->link));
  const auto first = parameter.written_at();
  return broadcast_registers(parameter.table, first, registers).map_error([&](Error error) {
    return about(std::move(error), parameter.name, parameter.address);
  });
}

/// No register says when it is done, so the longest time that it may take is waited for.
Result<void> Device::broadcast(const catalogue::Action& action, std::int64_t value) {
  Result<void> sent;
  if (action.prepare) sent = broadcast_word(action.prepare->address, 0);
  if (sent && action.rest) sent = broadcast_word(action.address, *action.rest);
  if (sent) sent = broadcast(as_parameter(action), Value{Decimal(value)});
  if (!sent || !action.rest) return sent;
  if (action.busy > Duration::zero()) {
    sent = clock().sleep_until(clock().now() + action.busy);
  }
  return sent ? broadcast_word(action.address, *action.rest) : sent;
}

}  // namespace spindle::device
