#include "motor_setup.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <limits>
#include <utility>
#include <vector>

#include "guarded_run.hpp"
#include "spindle/catalogue/value.hpp"

namespace spindle::commands {

using catalogue::Parameter;
using catalogue::RunFacts;
using catalogue::Value;

namespace {

/// A neighbour that is switched off must not keep the user waiting.
constexpr Duration neighbours_answer = std::chrono::milliseconds(150);

/// The half of a 32-bit parameter that holds all of its value, as long as that is small: it is
/// written by function 06, which the children of a group do not follow. A whole pair would be
/// written into them as well.
Parameter low_half(Parameter parameter) {
  parameter.address = {static_cast<std::uint16_t>(parameter.address.value + 1)};
  parameter.encoding.kind = catalogue::Kind::u16;
  return parameter;
}

/// Whether the upper half of a pair is 0 with this value.
bool is_small(const Parameter& parameter, const Value& value) {
  const auto registers = catalogue::encode(parameter, value.number);
  return registers && registers->size() == 2 && registers->front() == 0;
}

/// "io.net-in.{n}" as it is typed for all of them.
std::string glob_of(std::string pattern) {
  constexpr std::string_view counter = "{n}";
  const std::size_t at = pattern.find(counter);
  if (at != std::string::npos) pattern.replace(at, counter.size(), "*");
  return pattern;
}

}  // namespace

Result<void> MotorSetup::look() {
  return read_settings().and_then([&] { return check_ready(); });
}

Result<void> MotorSetup::prepare() {
  return look()
      .and_then([&] { return clear_word(); })
      .and_then([&] { return write_settings(); })
      .and_then([&] { return set_watchdog(); });
}

Result<void> MotorSetup::read_settings() {
  const RunFacts& run = facts();
  std::vector<std::string> names = {run.command, run.mode,
                                    catalogue::numbered_name(run.deceleration, plan_->operation)};
  for (const std::string* name : {&run.analog, &run.watchdog}) {
    if (!name->empty()) names.push_back(*name);
  }
  auto wanted = tool_->profile->select(names);
  if (!wanted) return tl::unexpected(std::move(wanted.error()));
  const auto readings = tool_->device.read_each(*wanted, device::Limits::skip);
  if (!readings) return tl::unexpected(readings.error());
  for (const device::Reading& reading : *readings) {
    if (!reading.value) return tl::unexpected(reading.value.error());
  }
  const auto value = [&](std::size_t at) { return *(*readings)[at].value; };
  found_.word = static_cast<std::uint16_t>(value(0).number.mantissa());
  found_.mode = value(1).number.mantissa();
  found_.stopping = device::time_of((*readings)[2], device::longest_stop(*tool_->profile));
  std::size_t next = 3;
  found_.analog = run.analog.empty() ? run.digital : value(next++).number.mantissa();
  if (!run.watchdog.empty()) found_.watchdog = value(next);
  auto bits = plan_->motor.read_bits(tool_->device, std::numeric_limits<std::uint16_t>::max());
  if (!bits) return tl::unexpected(std::move(bits.error()));
  found_.bits = *bits;
  return {};
}

std::uint16_t MotorSetup::standard_word() const {
  const catalogue::RunWords& words = facts().modes.at(found_.mode);
  const unsigned run =
      plan_->direction == catalogue::Direction::forward ? words.forward : words.reverse;
  return static_cast<std::uint16_t>(run | facts().selecting(plan_->operation));
}

Result<void> MotorSetup::check_ready() {
  const auto state = plan_->motor.look(tool_->device);
  if (!state) return tl::unexpected(state.error());
  const auto refuse = [this](std::string message, std::string hint) {
    return tl::unexpected(not_ready(tool_->target, std::move(message), std::move(hint)));
  };
  if (state->alarm != 0) {
    return refuse(
        fmt::format("alarm {:02X}h is present, so the motor was not started", state->alarm),
        "'spindle alarms' shows what it means");
  }
  if (state->running || state->command_speed != 0) {
    return refuse("the motor runs already, so it was not started",
                  "wait until it stands still, or stop it with 'spindle remote-stop'");
  }
  if (state->busy) {
    return refuse("the driver is busy, so the motor was not started", "try again in a second");
  }
  if (!facts().modes.contains(found_.mode)) {
    return refuse(
        fmt::format("{} is {}, which the profile does not know", facts().mode, found_.mode),
        "'spindle get' shows it");
  }
  return check_inputs().and_then([&] { return check_analog(); });
}

/// A start whose word can not be made for this driver is none.
Result<void> MotorSetup::check_inputs() const {
  const std::uint16_t word = standard_word();
  if (found_.bits.word(word)) return {};
  std::vector<std::int64_t> missing;
  for (const catalogue::InputFunction& function : facts().inputs.functions) {
    if (!function.bit) continue;
    const auto bit = static_cast<std::uint16_t>(1U << *function.bit);
    if ((word & bit) != 0 && !found_.bits.word(bit)) missing.push_back(function.number);
  }
  return tl::unexpected(
      not_ready(tool_->target,
                fmt::format("no input of this driver has function {}, which this start needs, so "
                            "the motor was not started",
                            fmt::join(missing, ", ")),
                fmt::format("'spindle get' with '{}' shows what the inputs are assigned to",
                            glob_of(facts().inputs.parameter))));
}

Result<void> MotorSetup::check_analog() const {
  const RunFacts& run = facts();
  const bool from_outside =
      !run.analog.empty() && found_.analog != run.digital && plan_->operation <= run.analog_to;
  if (!from_outside) return {};
  return tl::unexpected(
      bad_option("--operation",
                 fmt::format("the speed of operation data {} comes from outside while {} is {}",
                             plan_->operation, run.analog, found_.analog),
                 fmt::format("use --operation {}, or set {}={} and run 'do configure'",
                             run.preferred, run.analog, run.digital)));
}

/// A word that runs at speed 0 would start the motor when its speed is set.
Result<void> MotorSetup::clear_word() {
  if ((found_.word & found_.bits.any_of(facts().starting)) == 0) return {};
  const auto standard = found_.bits.standard(found_.word);
  cleared_word_ = !standard || plan_->motor.runs(*standard, found_.mode);
  return plan_->motor.command(tool_->device, plan_->motor.idle_word());
}

Result<void> MotorSetup::write_one(const Parameter& parameter, const Value& value) {
  const auto before = tool_->device.read_each({parameter}, device::Limits::skip);
  if (!before) return tl::unexpected(before.error());
  const device::Reading& reading = before->front();
  if (!reading.value) return tl::unexpected(reading.value.error());
  if (*reading.value == value) return {};
  const bool halved =
      !facts().group.empty() && is_small(parameter, *reading.value) && is_small(parameter, value);
  auto written = changer_.make(halved ? low_half(parameter) : parameter, *reading.value, value);
  if (written.done()) return {};
  return tl::unexpected(std::move(*written.error));
}

Result<void> MotorSetup::write_settings() {
  for (const auto& [parameter, value] : plan_->settings) {
    if (auto written = write_one(parameter, value); !written) {
      return tl::unexpected(work::of_write(parameter.name, std::move(written.error())));
    }
    const bool is_stop =
        parameter.name == catalogue::numbered_name(facts().deceleration, plan_->operation);
    if (is_stop) {
      device::Reading reading{.parameter = parameter, .registers = {}, .value = value};
      found_.stopping = device::time_of(reading, found_.stopping);
    }
  }
  return {};
}

Result<void> MotorSetup::set_watchdog() {
  const bool is_off = !found_.watchdog || found_.watchdog->number == Decimal(0);
  if (plan_->watchdog) {
    return write_one(*plan_->watchdog_parameter, *plan_->watchdog);
  }
  if (is_off && plan_->watchdog_parameter) {
    context_->renderer.note(
        fmt::format("{}: {} is off: if this computer or the line fails, the motor runs on; with "
                    "--watchdog 1s the driver itself stops it",
                    tool_->target.shown, plan_->watchdog_parameter->name));
  }
  return {};
}

std::vector<Left> MotorSetup::put_back() {
  std::vector<Left> left;
  add_cleared_word(left);
  if (changer_.sent().empty()) return left;
  if (context_->calm.stay_awake) context_->calm.stay_awake();
  device::Rollback rollback(
      tool_->device, [this](Duration patience) { return calm_line_.connect(patience); },
      context_->calm.clock);
  for (const device::PutBackReport& report : changer_.put_back(rollback)) {
    const bool as_before =
        report.result == device::PutBack::done || report.result == device::PutBack::kept;
    if (!as_before) left.push_back(left_of(report.write, report.trouble));
  }
  return left;
}

std::vector<Left> MotorSetup::left() const {
  std::vector<Left> left;
  add_cleared_word(left);
  for (const device::TriedWrite& write : changer_.sent()) {
    left.push_back(left_of(write, "the motor may still run"));
  }
  return left;
}

Left MotorSetup::left_of(const device::TriedWrite& write, std::string trouble) const {
  const Parameter& parameter = write.parameter;
  const std::string unit = parameter.unit.empty() ? "" : " " + parameter.unit;
  if (parameter.name == facts().watchdog) {
    trouble += "; the driver stops with an alarm when nobody asks it";
  }
  return {.name = parameter.name,
          .set = write.tried.to_string() + unit,
          .before = write.before.to_string() + unit,
          .trouble = std::move(trouble)};
}

/// A run bit is never set again: it would start the motor as soon as a speed is set.
void MotorSetup::add_cleared_word(std::vector<Left>& left) const {
  if (!cleared_word_) return;
  left.push_back({.name = facts().command,
                  .set = "no run bit",
                  .before = fmt::format("{:02X}h", found_.word),
                  .trouble = "its run bit would start the motor when a speed is set"});
}

// ---- groups ----

Result<std::string> MotorSetup::group_in_words() {
  if (facts().group.empty()) return std::string();
  const auto parameter = tool_->profile->find(facts().group);
  if (!parameter) return tl::unexpected(parameter.error());
  device::Device& device = tool_->device;
  link::Session& session = device.session();
  const auto parent_of_present = [&]() -> Result<std::optional<std::int64_t>> {
    const auto readings = device.read_each({*parameter}, device::Limits::skip);
    if (!readings) return tl::unexpected(readings.error());
    const auto& value = readings->front().value;
    if (!value) return std::nullopt;
    return value->number.mantissa();
  };
  const auto own_parent = parent_of_present();
  if (!own_parent) return tl::unexpected(own_parent.error());
  const modbus::UnitId unit = session.options().unit;
  const Duration usual = session.options().answer_timeout;
  std::vector<std::string> children;
  if (*own_parent == unit.value) children.emplace_back("others");
  session.set_answer_timeout(std::min(usual, neighbours_answer));
  device.set_retries(0);
  for (const Target& neighbour : neighbours()) {
    session.set_unit(*neighbour.endpoint.unit);
    const auto parent = parent_of_present();
    if (parent && *parent == unit.value) children.push_back(neighbour.shown);
  }
  session.set_unit(unit);
  session.set_answer_timeout(usual);
  device.set_retries(context_->common.retries.value_or(tool_->profile->link.retries));
  if (!children.empty()) {
    return fmt::format(
        "{} is the parent of a group ({}), of which only its own motor is set and "
        "started",
        tool_->target.shown, fmt::join(children, ", "));
  }
  const bool is_child = *own_parent && **own_parent > 0 && **own_parent != unit.value;
  if (!is_child) return std::string();
  return fmt::format("{} belongs to the group of unit {}, which is not started with it",
                     tool_->target.shown, **own_parent);
}

/// The other drivers of the tools file on the same line.
std::vector<Target> MotorSetup::neighbours() const {
  std::vector<Target> found;
  const std::string line = shared_line(tool_->target.endpoint);
  if (line.empty()) return found;
  for (const files::Tool& tool : context_->tools.tools) {
    for (Target& other : resolve_each_target({tool.name}, *context_).targets) {
      const auto& unit = other.endpoint.unit;
      const bool is_other =
          unit && unit->value != 0 && unit->value != tool_->device.session().options().unit.value;
      const bool fits =
          is_other && other.profile == tool_->profile->id && shared_line(other.endpoint) == line;
      if (fits) found.push_back(std::move(other));
    }
  }
  return found;
}

}  // namespace spindle::commands
