#include "spindle/work/motor_setup.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <utility>

#include "spindle/catalogue/value.hpp"

namespace spindle::work {

using catalogue::Parameter;
using catalogue::Value;

namespace {

/// Turns a minute as people read them.
std::string unit_in_words(const std::string& unit) { return unit == "rpm" ? "r/min" : unit; }

std::string value_in_words(const Parameter& parameter, const Value& value) {
  return value.to_string() + (parameter.unit.empty() ? "" : " ") + parameter.unit;
}

}  // namespace

std::string MotorPlan::speed_in_words() const {
  if (!speed) return {};
  return speed->to_string() + (speed_unit.empty() ? "" : " ") + speed_unit;
}

Result<Setting> parse_setting(std::string_view option, const Parameter& parameter,
                              std::string_view text) {
  const std::string& unit = parameter.unit;
  if (!unit.empty() && text.size() > unit.size() && text.ends_with(unit)) {
    text.remove_suffix(unit.size());
  }
  auto value = catalogue::parse_exact_value(parameter, text);
  if (!value) {
    value.error().name = option;
    return tl::unexpected(std::move(value.error()));
  }
  return Setting(parameter, std::move(*value));
}

Result<void> add_speed(const Parameter& parameter, MotorPlan& plan) {
  TRY_LET(auto setting, parse_setting("--speed", parameter, plan.options.speed));
  plan.speed = setting.second.number;
  plan.speed_unit = unit_in_words(parameter.unit);
  plan.settings.push_back(std::move(setting));
  return {};
}

std::string settings_in_words(const std::vector<Setting>& settings) {
  std::vector<std::string> words;
  for (const auto& [parameter, value] : settings) {
    words.push_back(fmt::format("{}={}", parameter.name, value_in_words(parameter, value)));
  }
  return fmt::format("{}", fmt::join(words, ", "));
}

Result<void> MotorSetup::check_at_rest() {
  if (monitor_ == nullptr) return {};
  TRY_LET(const auto state, monitor_->look(tool_->device));
  const auto refuse = [this](std::string message, std::string hint) {
    return tl::unexpected(not_ready(tool_->target, std::move(message), std::move(hint)));
  };
  if (state.alarm != 0) {
    return refuse(
        fmt::format("alarm {:02X}h is present, so the motor was not started", state.alarm),
        "'spindle alarms' shows what it means");
  }
  if (state.running || state.command_speed.value_or(Decimal(0)) != Decimal(0)) {
    return refuse("the motor runs already, so it was not started",
                  "wait until it stands still, or stop it with 'spindle remote-stop'");
  }
  if (state.busy) {
    return refuse("the driver is busy, so the motor was not started", "try again in a second");
  }
  return {};
}

Parameter MotorSetup::written_as(const Parameter& parameter, const Value& /*before*/,
                                 const Value& /*value*/) const {
  return parameter;
}

Result<void> MotorSetup::write_one(const Parameter& parameter, const Value& value) {
  TRY_LET(const auto before, tool_->device.read_each({parameter}, device::Limits::skip));
  const device::Reading& reading = before.front();
  if (!reading.value) return tl::unexpected(reading.value.error());
  if (*reading.value == value) return {};
  auto written = changer_.make(written_as(parameter, *reading.value, value), *reading.value, value);
  if (written.done()) return {};
  return tl::unexpected(std::move(*written.error));
}

std::vector<Left> MotorSetup::put_back() {
  std::vector<Left> left;
  add_left(left);
  if (changer_.sent().empty()) return left;
  if (environment_->uninterruptible.refuse_suspend) environment_->uninterruptible.refuse_suspend();
  begin_put_back();
  device::Rollback rollback(
      tool_->device, [this](Duration patience) { return uninterruptible_line_.connect(patience); },
      environment_->uninterruptible.clock);
  for (const device::PutBackReport& report : changer_.put_back(rollback)) {
    const bool as_before = report.result == device::RollbackResult::done ||
                           report.result == device::RollbackResult::kept;
    if (!as_before) left.push_back(left_of(report.write, report.trouble));
  }
  return left;
}

std::vector<Left> MotorSetup::left() const {
  std::vector<Left> left;
  add_left(left);
  for (const device::JournalEntry& write : changer_.sent()) {
    left.push_back(left_of(write, "the motor may still run"));
  }
  return left;
}

std::string MotorSetup::left_note(const Parameter& /*parameter*/) const { return {}; }

Left MotorSetup::left_of(const device::JournalEntry& write, std::string trouble) const {
  return {.name = write.parameter.name,
          .set = value_in_words(write.parameter, write.tried),
          .before = value_in_words(write.parameter, write.before),
          .trouble = std::move(trouble) + left_note(write.parameter)};
}

}  // namespace spindle::work
