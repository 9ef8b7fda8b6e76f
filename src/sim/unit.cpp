#include "unit.hpp"

#include <algorithm>
#include <utility>
#include <variant>
#include <vector>

#include "identity.hpp"

namespace spindle::sim {

using catalogue::EventKind;
using modbus::ExceptionCode;
using modbus::FunctionCode;
using modbus::Pdu;
using modbus::RegisterTable;

Unit::Unit(const catalogue::Profile& profile, const catalogue::SimulationSpec& start,
           std::uint8_t address, const DeviceOptions& options, RegisterBank::Commands commands)
    : address_(address),
      link_(profile.link),
      bank_(profile, start, commands),
      events_(profile, bank_, firmware_of(profile.identity, start, options)),
      store_(options.faults),
      identity_(make_identity(profile.identity, start, options)),
      limit_exception_(start.limit_exception),
      permanent_alarms_(start.permanent_alarms),
      event_values_(start.events),
      rundown_every_(options.rundown_every),
      ng_every_(options.ng_every),
      burst_(options.burst) {}

bool Unit::is_permanent(std::int64_t alarm) const {
  return std::find(permanent_alarms_.begin(), permanent_alarms_.end(), alarm) !=
         permanent_alarms_.end();
}

// ---- requests ----

Pdu Unit::answer(ConnectionId connection, const Pdu& request, TimePoint now) {
  auto response = respond({connection, request, now});
  if (response) return std::move(*response);
  on_refusal(response.error());
  return modbus::exception_response(request.function, response.error().exception);
}

Unit::Answer Unit::respond(const Query& query) {
  const auto parsed = modbus::parse_request(query.pdu);
  if (!parsed) return tl::unexpected(refusal(parsed.error()));
  return std::visit([&](const auto& request) { return serve(request, query); }, *parsed);
}

Unit::Answer Unit::serve(const modbus::ReadRequest& request, const Query& query) {
  if (!bank_.has(request.table)) return tl::unexpected(refusal(ExceptionCode::illegal_function));
  const bool is_bits = modbus::holds_bits(request.table);
  if (request.count > (is_bits ? link_.max_read_bits : link_.max_read)) {
    return tl::unexpected(refusal(ExceptionCode::illegal_data_value));
  }
  before_read(query.now);
  const auto registers = bank_.read(request.table, request.first.value, request.count);
  if (!registers) return tl::unexpected(refusal(ExceptionCode::illegal_data_address));
  bank_.note_read(request.table, request.first.value, request.count);
  return modbus::read_response(request.table, *registers);
}

Unit::Answer Unit::serve(const modbus::WriteSingleRequest& request, const Query& query) {
  return serve_write({request.address, {request.value}, request.table}, query.pdu, query);
}

Unit::Answer Unit::serve(const modbus::WriteMultipleRequest& request, const Query& query) {
  const auto count = static_cast<std::uint16_t>(request.values.size());
  return serve_write(request, modbus::write_multiple_response(request.first, count, request.table),
                     query);
}

Unit::Answer Unit::serve(const modbus::LoopbackRequest& /*request*/, const Query& query) const {
  if (!link_.loopback) return tl::unexpected(refusal(ExceptionCode::illegal_function));
  return query.pdu;
}

Unit::Answer Unit::serve(const modbus::ReportServerIdRequest& /*request*/,
                         const Query& /*query*/) const {
  if (identity_.empty()) return tl::unexpected(refusal(ExceptionCode::illegal_function));
  return modbus::report_server_id_response(identity_);
}

Unit::Answer Unit::serve_write(const modbus::WriteMultipleRequest& request, Pdu response,
                               const Query& query) {
  Outcome refused = check_write(query.pdu.function, request);
  if (!refused) refused = write(query.connection, request, query.now);
  if (refused) return tl::unexpected(*refused);
  return response;
}

/// Whether the product writes holding registers with this function at all.
bool Unit::writes_with(std::uint8_t function) const {
  const auto single = static_cast<std::uint8_t>(FunctionCode::write_single_register);
  if (link_.write_function) return function == *link_.write_function;
  return function == single || link_.max_write > 1;
}

Unit::Outcome Unit::check_write(std::uint8_t function,
                                const modbus::WriteMultipleRequest& request) const {
  constexpr std::size_t addresses = 0x10000;
  const bool is_holding = request.table == RegisterTable::holding;
  const bool is_known = bank_.has_cells(request.table) && (!is_holding || writes_with(function));
  if (!is_known) return refusal(ExceptionCode::illegal_function);
  const std::size_t most =
      is_holding ? std::max<std::size_t>(link_.max_write, 1) : modbus::max_write_bits;
  if (request.values.size() > most) return refusal(ExceptionCode::illegal_data_value);
  if (request.first.value + request.values.size() > addresses) {
    return refusal(ExceptionCode::illegal_data_address);
  }
  return std::nullopt;
}

Unit::Outcome Unit::check(const Change& change) const {
  if (change.cell == nullptr) return refusal(ExceptionCode::illegal_data_address);
  if (bank_.is_locked(*change.cell)) return refusal(ExceptionCode::illegal_data_value);
  if (!change.cell->takes(change.registers)) return Refusal{limit_exception_};
  return std::nullopt;
}

Unit::Outcome Unit::write(ConnectionId connection, const modbus::WriteMultipleRequest& request,
                          TimePoint now) {
  const auto changes = bank_.changes(request.table, request.first.value, request.values);
  for (const Change& change : changes) {
    if (Outcome refused = check(change)) return refused;
  }
  if (!store_.accept()) return std::nullopt;
  for (const auto& [cell, registers] : changes) store_.store(cell->place, registers, bank_);
  for (const auto& [cell, registers] : changes) {
    const std::int64_t raw = stored_in(cell->place.encoding, registers);
    if (events_.is_arming(cell->place)) events_.arm(connection, raw, now);
    on_write(cell->place, raw, now);
  }
  return std::nullopt;
}

// ---- time ----

std::optional<TimePoint> Unit::next_change() const {
  const auto step = next_step();
  if (!step || !next_rundown_) return step ? step : next_rundown_;
  return std::min(*step, *next_rundown_);
}

void Unit::advance(TimePoint now) {
  const bool has_operator = rundown_every_ && *rundown_every_ > Duration::zero();
  if (has_operator && !next_rundown_) next_rundown_ = now + *rundown_every_;
  for (auto due = next_change(); due && *due <= now; due = next_change()) {
    if (const auto own = next_step(); own && *own <= *due) step(*due);
    if (next_rundown_ && *next_rundown_ <= *due) run_down(*due);
  }
}

void Unit::run_down(TimePoint now) {
  next_rundown_ = now + *rundown_every_;
  const bool fails = ng_every_ != 0 && (rundowns_ + 1) % ng_every_ == 0;
  if (operate(fails ? Rundown::ng : Rundown::ok, burst_, now)) ++rundowns_;
}

// ---- events ----

bool Unit::operate(Rundown outcome, unsigned results, TimePoint now) {
  for (unsigned told = 0; told < results; ++told) {
    happen(outcome == Rundown::ok ? EventKind::fastening_ok : EventKind::fastening_ng, now);
  }
  return true;
}

void Unit::happen(EventKind kind, TimePoint now) {
  if (!events_.knows(kind)) return;
  const auto says = [kind](const auto& event) { return event.kind == kind; };
  const auto choices =
      static_cast<std::size_t>(std::count_if(event_values_.begin(), event_values_.end(), says));
  EventBlock::Values values;
  if (choices > 0) {
    std::size_t turn = turns_[kind]++ % choices;
    const auto chosen = std::find_if(event_values_.begin(), event_values_.end(),
                                     [&](const auto& event) { return says(event) && turn-- == 0; });
    for (const auto& value : chosen->values) values.emplace_back(value.pattern, value.raw);
  }
  events_.emit(kind, values, now);
}

}  // namespace spindle::sim
