#include "profile_unit.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace spindle::sim {
namespace {

using catalogue::CommandRegisterSpec;
using catalogue::Parameter;
using modbus::ExceptionCode;
using modbus::Pdu;

/// Between standstill and any speed.
constexpr Duration ramp = std::chrono::seconds(1);
/// In steps of its own monitor, of a motor that has no set-point.
constexpr std::int64_t fixed_speed = 1000;

long double worth_of(const Decimal& number) {
  return static_cast<long double>(number.mantissa()) * std::pow(10.0L, number.exponent());
}

std::uint8_t code_of(ExceptionCode code) { return static_cast<std::uint8_t>(code); }

}  // namespace

ProfileUnit::ProfileUnit(const catalogue::Profile& profile, const catalogue::SimulationSpec& start,
                         std::uint8_t address, Bytes identity)
    : address_(address),
      permanent_alarms_(start.permanent_alarms),
      limit_exception_(start.limit_exception),
      max_read_(profile.link.max_read),
      max_write_(profile.link.max_write),
      loopback_(profile.link.loopback),
      identity_(std::move(identity)),
      registers_(profile, start, BlvRegisters::Layout::exactly_as_named) {
  if (!profile.run) return;
  if (const auto* facts = profile.run->command_register()) run_ = *facts;
  if (auto reset = profile.find_action(profile.alarm_reset)) alarm_reset_ = std::move(*reset);
  if (!run_) return;
  begin_stopped();
  for (const catalogue::Text* name :
       {&run_->command, &run_->stop_register, &run_->enable.parameter, &run_->set_point,
        &run_->monitor.command_speed, &run_->monitor.feedback_speed}) {
    if (auto parameter = profile.find(*name)) parameters_.push_back(std::move(*parameter));
  }
}

/// Where nothing else was said of the command.
void ProfileUnit::begin_stopped() {
  if (run_ && run_->stop && number(run_->command) == 0) registers_.set(run_->command, *run_->stop);
}

const Parameter* ProfileUnit::find(const std::string& name) const {
  const auto found = std::find_if(parameters_.begin(), parameters_.end(),
                                  [&](const Parameter& each) { return each.name == name; });
  return found == parameters_.end() ? nullptr : &*found;
}

std::uint32_t ProfileUnit::number(const std::string& name) const {
  return static_cast<std::uint32_t>(registers_.get(name));
}

// ---- requests ----

Pdu ProfileUnit::answer(const Pdu& request, TimePoint now) { return respond(request, now); }

Pdu ProfileUnit::respond(const Pdu& request, TimePoint now) {
  const auto refuse = [&](std::uint8_t code) {
    return modbus::exception_response(request.function, code);
  };
  const auto parsed = modbus::parse_request(request);
  if (!parsed) return refuse(code_of(parsed.error()));
  if (const auto* wanted = std::get_if<modbus::ReadRequest>(&*parsed)) {
    return read(request, *wanted, now);
  }
  if (const auto* wanted = std::get_if<modbus::WriteSingleRequest>(&*parsed)) {
    const Registers one = {wanted->value};
    const Refusal refused = write(wanted->address.value, one, now);
    return refused ? refuse(*refused) : request;
  }
  const auto* several = std::get_if<modbus::WriteMultipleRequest>(&*parsed);
  if (several != nullptr && max_write_ > 1) {
    const Refusal refused = write(several->first.value, several->values, now);
    if (refused) return refuse(*refused);
    return modbus::write_multiple_response(several->first,
                                           static_cast<std::uint16_t>(several->values.size()));
  }
  if (loopback_ && std::holds_alternative<modbus::LoopbackRequest>(*parsed)) return request;
  if (!identity_.empty() && std::holds_alternative<modbus::ReportServerIdRequest>(*parsed)) {
    return modbus::report_server_id_response(identity_);
  }
  return refuse(code_of(ExceptionCode::illegal_function));
}

Pdu ProfileUnit::read(const Pdu& request, const modbus::ReadRequest& wanted, TimePoint now) {
  const auto refuse = [&](ExceptionCode code) {
    return modbus::exception_response(request.function, code_of(code));
  };
  if (wanted.count > max_read_) return refuse(ExceptionCode::illegal_data_value);
  show(now);
  const auto words = registers_.read(wanted.table, wanted.first.value, wanted.count);
  if (!words) return refuse(ExceptionCode::illegal_data_address);
  return modbus::read_response(wanted.table, *words);
}

/// All of it or nothing, each value whole: a register alone changes one half of its value.
ProfileUnit::Refusal ProfileUnit::write(std::uint16_t first, RegisterView values, TimePoint now) {
  if (values.size() > max_write_) return code_of(ExceptionCode::illegal_data_value);
  std::vector<std::pair<BlvRegisters::Cell, std::uint32_t>> changes;
  for (std::size_t i = 0; i < values.size();) {
    const auto cell = registers_.cell_at(static_cast<std::uint16_t>(first + i));
    if (!cell) return code_of(ExceptionCode::illegal_data_address);
    const std::uint32_t raw = registers_.with_words(*cell, first, values, i);
    if (!registers_.takes(*cell, raw)) return limit_exception_;
    changes.emplace_back(*cell, raw);
  }
  for (const auto& [cell, raw] : changes) {
    registers_.set_raw(cell, raw);
    act_on(cell, raw, now);
  }
  return std::nullopt;
}

void ProfileUnit::act_on(const BlvRegisters::Cell& cell, std::uint32_t raw, TimePoint now) {
  const unsigned end = unsigned{cell.first} + catalogue::register_count(cell.kind);
  const bool resets = alarm_reset_ && alarm_reset_->address.value >= cell.first &&
                      alarm_reset_->address.value < end && raw == alarm_reset_->value;
  if (resets && run_) {
    const std::int64_t present = registers_.get(run_->monitor.alarm);
    const bool stays = std::find(permanent_alarms_.begin(), permanent_alarms_.end(), present) !=
                       permanent_alarms_.end();
    if (!stays) registers_.set(run_->monitor.alarm, 0);
  }
  if (!run_) return;
  const auto is_at = [&](const std::string& name) {
    const Parameter* parameter = find(name);
    return parameter != nullptr && parameter->address.value == cell.first;
  };
  if (is_at(run_->command)) stopped_ = false;
  if (is_at(run_->stop_register) && raw == run_->stop_value) stopped_ = true;
  obey(now);
}

// ---- the motor, in steps of its set-point ----

bool ProfileUnit::is_enabled() const {
  const catalogue::EnableSpec& enable = run_->enable;
  if (enable.parameter.empty()) return true;
  const std::uint32_t value = number(enable.parameter);
  return enable.bit ? (value >> *enable.bit & 1U) != 0 : value == enable.value;
}

ProfileUnit::Wish ProfileUnit::wish() const {
  if (stopped_) return Wish::stop;
  const catalogue::EnableSpec& enable = run_->enable;
  std::uint32_t value = number(run_->command);
  if (enable.bit && enable.parameter == run_->command) value &= ~(std::uint32_t{1} << *enable.bit);
  if (value == run_->forward) return Wish::forward;
  if (value == run_->reverse) return Wish::reverse;
  return value == run_->instant ? Wish::stop_at_once : Wish::stop;
}

std::int64_t ProfileUnit::wanted_speed() const {
  return run_->set_point.empty() ? fixed_speed : registers_.get(run_->set_point);
}

/// What is not enabled is acknowledged, and nothing turns.
void ProfileUnit::obey(TimePoint now) {
  const bool is_free = registers_.get(run_->monitor.alarm) == 0 && is_enabled();
  if (!is_free) {
    if (motor_.moves(now)) motor_.coast(now);
    return;
  }
  switch (wish()) {
    case Wish::forward:
    case Wish::reverse:
      reverse_ = wish() == Wish::reverse;
      motor_.go_to(reverse_ ? -wanted_speed() : wanted_speed(), ramp, ramp, now);
      return;
    case Wish::stop:
      if (motor_.target() != 0) motor_.go_to(0, ramp, ramp, now);
      return;
    case Wish::stop_at_once:
      motor_.brake(now);
      return;
  }
}

std::int64_t ProfileUnit::status(TimePoint now) const {
  const catalogue::MonitorSpec& monitor = run_->monitor;
  const bool moves = motor_.moves(now);
  if (!monitor.running) {
    const auto& values = moves ? monitor.running_values : monitor.stopped_values;
    if (values.empty()) return 0;
    return moves && reverse_ && values.size() > 1 ? values[1] : values.front();
  }
  const bool is_there = motor_.target() != 0 && motor_.speed(now) == motor_.target();
  std::uint32_t word = moves ? std::uint32_t{1} << *monitor.running : 0;
  if (monitor.at_speed && is_there) word |= std::uint32_t{1} << *monitor.at_speed;
  return word;
}

/// In the scale of the monitor; one that is not signed does not tell the direction.
void ProfileUnit::show_speed(const std::string& name, TimePoint now) {
  const Parameter* monitor = find(name);
  if (monitor == nullptr) return;
  const Parameter* set_point = find(run_->set_point);
  const Decimal step = set_point == nullptr ? monitor->encoding.scale : set_point->encoding.scale;
  const long double speed = static_cast<long double>(motor_.speed(now)) * worth_of(step) /
                            worth_of(monitor->encoding.scale);
  const bool is_signed = catalogue::lowest(monitor->encoding.kind) < 0;
  registers_.set(name, std::llround(is_signed ? speed : std::fabs(speed)));
}

void ProfileUnit::show(TimePoint now) {
  if (!run_) return;
  if (!run_->monitor.status.empty()) registers_.set(run_->monitor.status, status(now));
  show_speed(run_->monitor.command_speed, now);
  show_speed(run_->monitor.feedback_speed, now);
}

// ---- what goes wrong ----

void ProfileUnit::raise_alarm(std::int64_t code, TimePoint now) {
  if (!run_) return;
  registers_.set(run_->monitor.alarm, code);
  motor_.coast(now);
}

void ProfileUnit::raise_warning(std::int64_t code, TimePoint /*now*/) {
  if (run_) registers_.set(run_->monitor.warning, code);
}

void ProfileUnit::power_cycle(TimePoint now) {
  registers_.restart();
  motor_.brake(now);
  stopped_ = false;
  begin_stopped();
}

}  // namespace spindle::sim
