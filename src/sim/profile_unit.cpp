#include "profile_unit.hpp"

#include <cstdlib>

namespace spindle::sim {
namespace {

using catalogue::Encoding;
using catalogue::EventKind;

/// Between standstill and any speed.
constexpr Duration ramp = std::chrono::seconds(1);
/// In steps of its own monitor, of a motor that has no set-point.
constexpr std::int64_t fixed_speed = 1000;
/// Of a run that an action starts.
constexpr Duration run_time = std::chrono::seconds(2);

/// The steps of a value; a floating-point number has none of its own.
Encoding steps_of(const Encoding& encoding) {
  return encoding.is_float() ? Encoding{.kind = catalogue::Kind::i64, .scale = Decimal(1, -3)}
                             : encoding;
}

std::int64_t plain(const catalogue::Integer& integer) {
  return Decimal(integer.sign, integer.magnitude, 0).mantissa();
}

/// The parameter that shows the present alarm.
catalogue::Text present_alarm(const catalogue::Profile& profile) {
  for (const catalogue::AlarmList& list : profile.alarm_lists) {
    if (list.name == "present" && !list.parameters.empty()) return list.parameters.front();
  }
  return {};
}

}  // namespace

ProfileUnit::ProfileUnit(const catalogue::Profile& profile, const catalogue::SimulationSpec& start,
                         std::uint8_t address, const DeviceOptions& options)
    : Unit(profile, start, address, options),
      actions_(profile.actions),
      busy_codes_(profile.link.busy),
      alarm_reset_(profile.alarm_reset),
      alarm_(present_alarm(profile)) {
  const bool is_started = profile.run && !profile.run->is_derived;
  if (const auto* facts = is_started ? profile.run->action() : nullptr) {
    start_action_ = facts->start;
    if (!facts->alarm.empty()) alarm_ = facts->alarm;
  }
  if (const auto* facts = profile.run ? profile.run->command_register() : nullptr) {
    run_ = *facts;
    alarm_ = run_->monitor.alarm;
    const auto& monitor = run_->monitor;
    for (const auto& name : {run_->set_point, monitor.feedback_speed, monitor.command_speed}) {
      const auto place = bank().find(name);
      if (!place) continue;
      step_ = steps_of(place->encoding);
      break;
    }
    // Where nothing else was said of the command.
    if (run_->stop && number(run_->command) == 0) bank().set(run_->command, *run_->stop);
  }
  start_ = bank().tables();
}

// ---- commands ----

Unit::Outcome ProfileUnit::write(ConnectionId connection,
                                 const modbus::WriteMultipleRequest& request, TimePoint now) {
  if (now < busy_until_) return Refusal{busy_codes_.front()};
  return Unit::write(connection, request, now);
}

void ProfileUnit::on_write(const Place& place, std::int64_t raw, TimePoint now) {
  for (const catalogue::Action& action : actions_) {
    const bool is_meant = place.covers(action.table, action.address.value) &&
                          place.encoding.slice == action.encoding.slice;
    if (is_meant) act(action, raw, now);
  }
  if (!run_) return;
  const auto is_at = [&](const std::string& name) {
    const auto named = bank().find(name);
    return named && named->table == place.table && named->address == place.address &&
           named->encoding.slice == place.encoding.slice;
  };
  if (is_at(run_->command)) stopped_ = false;
  if (is_at(run_->stop_register) && number(run_->stop_register) == run_->stop_value) {
    stopped_ = true;
  }
  drive(now);
}

/// What an action does is what its confirming parameter shows.
void ProfileUnit::act(const catalogue::Action& action, std::int64_t raw, TimePoint now) {
  const bool is_start = !start_action_.empty() && action.name == start_action_;
  if (raw == action.stop_value) {
    bank().set(action.confirm, 0);
    if (is_start && run_end_) end_run(EventKind::fastening_ng, now);
  }
  if (action.value && raw != *action.value) return;
  if (is_start) {
    if (run_end_ || bank().get(alarm_) != 0) return;
    run_end_ = now + run_time;
  }
  if (action.name == alarm_reset_) {
    if (is_permanent(bank().get(alarm_))) return;
    bank().set(alarm_, 0);
  }
  bank().set(action.confirm, action.confirm_value.value_or(raw));
  if (!busy_codes_.empty()) busy_until_ = now + action.busy;
}

void ProfileUnit::end_run(EventKind result, TimePoint now) {
  run_end_.reset();
  for (const catalogue::Action& action : actions_) {
    if (action.name == start_action_) bank().set(action.confirm, 0);
  }
  happen(result, now);
}

// ---- the motor, in steps of its set-point ----

bool ProfileUnit::is_enabled() const {
  const catalogue::EnableSpec& enable = run_->enable;
  if (enable.parameter.empty()) return true;
  const std::uint32_t value = number(enable.parameter);
  return enable.bit ? (value >> *enable.bit & 1U) != 0 : value == enable.value;
}

ProfileUnit::Motion ProfileUnit::commanded() const {
  if (stopped_) return Motion::stop;
  const catalogue::EnableSpec& enable = run_->enable;
  std::uint32_t value = number(run_->command);
  if (enable.bit && enable.parameter == run_->command) value &= ~(std::uint32_t{1} << *enable.bit);
  if (value == run_->forward) return Motion::forward;
  if (value == run_->reverse) return Motion::reverse;
  return value == run_->instant ? Motion::stop_at_once : Motion::stop;
}

std::int64_t ProfileUnit::wanted_speed() const {
  const auto set_point = bank().find(run_->set_point);
  const auto wanted = set_point ? bank().number(*set_point) : std::nullopt;
  const auto steps = wanted ? catalogue::nearest_step(step_, *wanted) : std::nullopt;
  if (steps) return plain(*steps);
  return set_point ? 0 : fixed_speed;
}

/// What is not enabled is acknowledged, and nothing turns.
void ProfileUnit::drive(TimePoint now) {
  const bool is_free = bank().get(alarm_) == 0 && is_enabled();
  if (!is_free) {
    if (motor_.moves(now)) motor_.coast(now);
    return;
  }
  switch (commanded()) {
    case Motion::forward:
    case Motion::reverse:
      reverse_ = commanded() == Motion::reverse;
      motor_.go_to(reverse_ ? -wanted_speed() : wanted_speed(), ramp, ramp, now);
      return;
    case Motion::stop:
      if (motor_.target() != 0) motor_.go_to(0, ramp, ramp, now);
      return;
    case Motion::stop_at_once:
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
  const auto monitor = bank().find(name);
  if (!monitor) return;
  const Encoding& shown = monitor->encoding;
  const bool is_signed = shown.is_float() || catalogue::lowest(shown) < Decimal(0);
  const std::int64_t speed = motor_.speed(now);
  const auto number = catalogue::scaled(step_, Decimal(is_signed ? speed : std::abs(speed)));
  if (number) bank().set_number(*monitor, *number);
}

void ProfileUnit::before_read(TimePoint now) {
  if (!run_) return;
  if (!run_->monitor.status.empty()) bank().set(run_->monitor.status, status(now));
  show_speed(run_->monitor.command_speed, now);
  show_speed(run_->monitor.feedback_speed, now);
}

// ---- what goes wrong ----

void ProfileUnit::raise_alarm(std::int64_t code, TimePoint now) {
  bank().set(alarm_, code);
  if (run_) motor_.coast(now);
  if (run_end_) end_run(EventKind::fastening_ng, now);
  happen(EventKind::error, now);
}

void ProfileUnit::raise_warning(std::int64_t code, TimePoint /*now*/) {
  if (run_) bank().set(run_->monitor.warning, code);
}

void ProfileUnit::power_cycle(TimePoint now) {
  const Tables before = bank().tables();
  bank().set_tables(start_);
  bank().take_parameters(before);
  events().restart();
  motor_.brake(now);
  stopped_ = false;
  run_end_.reset();
  busy_until_ = TimePoint::min();
}

}  // namespace spindle::sim
