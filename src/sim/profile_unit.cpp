#include "profile_unit.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace spindle::sim {
namespace {

using catalogue::Parameter;

/// Between standstill and any speed.
constexpr Duration ramp = std::chrono::seconds(1);
/// In steps of its own monitor, of a motor that has no set-point.
constexpr std::int64_t fixed_speed = 1000;

long double worth_of(const Decimal& number) {
  return static_cast<long double>(number.mantissa()) * std::pow(10.0L, number.exponent());
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
      alarm_reset_(profile.alarm_reset),
      alarm_(present_alarm(profile)) {
  const auto* facts = profile.run ? profile.run->command_register() : nullptr;
  if (facts != nullptr) {
    run_ = *facts;
    alarm_ = run_->monitor.alarm;
    for (const catalogue::Text* name :
         {&run_->command, &run_->stop_register, &run_->enable.parameter, &run_->set_point,
          &run_->monitor.command_speed, &run_->monitor.feedback_speed}) {
      if (auto parameter = profile.find(*name)) parameters_.push_back(std::move(*parameter));
    }
    // Where nothing else was said of the command.
    if (run_->stop && number(run_->command) == 0) bank().set(run_->command, *run_->stop);
  }
  start_ = bank().tables();
}

const Parameter* ProfileUnit::find(const std::string& name) const {
  const auto found = std::find_if(parameters_.begin(), parameters_.end(),
                                  [&](const Parameter& each) { return each.name == name; });
  return found == parameters_.end() ? nullptr : &*found;
}

// ---- commands ----

void ProfileUnit::on_write(const Place& place, std::uint32_t raw, TimePoint now) {
  for (const catalogue::Action& action : actions_) {
    if (place.covers(action.address.value)) act(action, raw);
  }
  if (!run_) return;
  const auto is_at = [&](const std::string& name) {
    const Parameter* parameter = find(name);
    return parameter != nullptr && parameter->address.value == place.address;
  };
  if (is_at(run_->command)) stopped_ = false;
  if (is_at(run_->stop_register) && raw == run_->stop_value) stopped_ = true;
  drive(now);
}

/// What an action does is what its confirming parameter shows.
void ProfileUnit::act(const catalogue::Action& action, std::uint32_t raw) {
  if (raw == action.stop_value) bank().set(action.confirm, 0);
  if (action.value && raw != *action.value) return;
  if (action.name == alarm_reset_) {
    if (is_permanent(bank().get(alarm_))) return;
    bank().set(alarm_, 0);
  }
  bank().set(action.confirm, action.confirm_value.value_or(raw));
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
  return run_->set_point.empty() ? fixed_speed : bank().get(run_->set_point);
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
  const Parameter* monitor = find(name);
  if (monitor == nullptr) return;
  const Parameter* set_point = find(run_->set_point);
  const Decimal step = set_point == nullptr ? monitor->encoding.scale : set_point->encoding.scale;
  const long double speed = static_cast<long double>(motor_.speed(now)) * worth_of(step) /
                            worth_of(monitor->encoding.scale);
  const bool is_signed = catalogue::lowest(monitor->encoding.kind) < 0;
  bank().set(name, std::llround(is_signed ? speed : std::fabs(speed)));
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
  happen(catalogue::EventKind::error, now);
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
}

}  // namespace spindle::sim
