#include "spindle/device/motor.hpp"

#include <algorithm>
#include <utility>

namespace spindle::device {
namespace {

using catalogue::MonitorSpec;

bool has_bit(std::int64_t word, std::optional<std::uint8_t> bit) {
  return bit && ((static_cast<std::uint64_t>(word) >> *bit) & 1U) != 0;
}

bool holds(const catalogue::List<std::int64_t>& values, std::int64_t value) {
  return std::find(values.begin(), values.end(), value) != values.end();
}

/// The speed that says that a motor runs whose status does not.
const catalogue::Text& telling_speed(const MonitorSpec& facts) {
  return facts.feedback_speed.empty() ? facts.command_speed : facts.feedback_speed;
}

}  // namespace

std::vector<MotorEvent> events_between(const MotorState& before, const MotorState& now) {
  std::vector<MotorEvent> events;
  if (now.running && !before.running) events.push_back(MotorEvent::started);
  if (now.running && now.at_speed && !(before.running && before.at_speed)) {
    events.push_back(MotorEvent::at_speed);
  }
  if (now.warning != 0 && now.warning != before.warning) events.push_back(MotorEvent::warning);
  if (now.alarm != 0 && now.alarm != before.alarm) events.push_back(MotorEvent::alarm);
  if (!now.running && before.running) events.push_back(MotorEvent::stopped);
  return events;
}

Result<MotorMonitor> MotorMonitor::of(const MonitorSpec& facts, const catalogue::Profile& profile) {
  MotorMonitor monitor;
  monitor.facts_ = facts;
  for (const catalogue::Text* name : {&facts.status, &facts.command_speed, &facts.feedback_speed,
                                      &facts.alarm, &facts.warning, &facts.load}) {
    if (name->empty()) continue;
    TRY_LET(auto parameter, profile.find(*name));
    if (name == &facts.command_speed || name == &facts.feedback_speed) {
      monitor.speed_unit_ = parameter.unit;
    }
    monitor.parameters_.push_back(catalogue::with_bits_for(std::move(parameter), std::nullopt));
  }
  const catalogue::Text& speed =
      facts.command_speed.empty() ? facts.feedback_speed : facts.command_speed;
  for (const catalogue::Parameter& parameter : monitor.parameters_) {
    if (parameter.name == facts.status || parameter.name == speed) {
      monitor.proof_.push_back(parameter);
    }
  }
  return monitor;
}

bool MotorMonitor::tells_running(std::string_view parameter) const {
  return parameter == (facts_.status.empty() ? telling_speed(facts_) : facts_.status);
}

bool MotorMonitor::tells(std::string_view parameter) const {
  return tells_running(parameter) || parameter == facts_.alarm || parameter == facts_.warning;
}

bool MotorMonitor::runs(std::int64_t status) const {
  return facts_.running ? has_bit(status, facts_.running) : holds(facts_.running_values, status);
}

bool MotorMonitor::is_busy(const Decimal& status) const {
  return has_bit(status.mantissa(), facts_.busy);
}

Result<void> MotorMonitor::note(const Reading& reading, MotorState& state) const {
  if (!reading.value) return tl::unexpected(reading.value.error());
  const std::string& name = reading.parameter.name;
  const Decimal& number = reading.value->number;
  if (name == facts_.status) {
    const std::int64_t status = number.mantissa();
    state.running = runs(status);
    state.at_speed = has_bit(status, facts_.at_speed);
    state.busy = is_busy(number);
  } else if (tells_running(name)) {
    state.running = number != Decimal(0);
  }
  if (name == facts_.command_speed) state.command_speed = number;
  if (name == facts_.feedback_speed) state.feedback_speed = number;
  if (name == facts_.alarm) state.alarm = number.mantissa();
  if (name == facts_.warning) state.warning = number.mantissa();
  if (name == facts_.load) state.load = number;
  return {};
}

Result<MotorState> MotorMonitor::look(Device& device) const {
  TRY_LET(const auto readings, device.read_each(parameters_, Limits::skip));
  MotorState state;
  for (const Reading& reading : readings) {
    TRY(note(reading, state));
  }
  return state;
}

/// A status that says neither "runs" nor "stands still" proves nothing.
bool MotorMonitor::is_still(const Reading& reading) const {
  const Decimal& number = reading.value->number;
  if (reading.parameter.name != facts_.status) return number == Decimal(0);
  const std::int64_t status = number.mantissa();
  return facts_.running ? !runs(status) : holds(facts_.stopped_values, status);
}

Result<Shown> MotorMonitor::stands_still(Device& device) const {
  TRY_LET(const auto readings, device.read_each(proof_, Limits::skip));
  for (const Reading& reading : readings) {
    if (!reading.value) return tl::unexpected(reading.value.error());
  }
  const bool still = std::all_of(readings.begin(), readings.end(),
                                 [this](const Reading& reading) { return is_still(reading); });
  return still ? Shown::yes : Shown::no;
}

Duration time_of(const Reading& reading, Duration fallback) {
  if (!reading.value) return fallback;
  const auto steps = reading.value->number.divided_by(Decimal(1, -3));
  return std::chrono::milliseconds(steps.value_or(0));
}

}  // namespace spindle::device
