#include "spindle/work/command_word_setup.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "spindle/catalogue/value.hpp"

namespace spindle::work {

using catalogue::CommandWordSpec;
using catalogue::Parameter;
using catalogue::Value;

namespace {

constexpr int looks_per_watchdog = 4;

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
  const auto registers = catalogue::encode(parameter, value);
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

Result<void> WordSetup::look() {
  return read_settings().and_then([&] { return check_ready(); });
}

Result<void> WordSetup::prepare() {
  return look()
      .and_then([&] { return clear_word(); })
      .and_then([&] { return write_settings(); })
      .and_then([&] { return set_watchdog(); });
}

Result<void> WordSetup::read_settings() {
  const CommandWordSpec& run = facts();
  std::vector<std::string> names = {run.command, run.mode,
                                    catalogue::numbered_name(run.deceleration, plan_->operation)};
  for (const catalogue::Text* name : {&run.analog, &run.watchdog}) {
    if (!name->empty()) names.push_back(*name);
  }
  TRY_LET(auto wanted, tool().profile->select(names));
  TRY_LET(const auto readings, tool().device.read_each(wanted, device::Limits::skip));
  for (const device::Reading& reading : readings) {
    if (!reading.value) return tl::unexpected(reading.value.error());
  }
  const auto value = [&](std::size_t at) { return *readings[at].value; };
  found_.word = static_cast<std::uint16_t>(value(0).number.mantissa());
  found_.mode = value(1).number.mantissa();
  found_.stopping = device::time_of(readings[2], device::longest_stop(*tool().profile));
  std::size_t next = 3;
  found_.analog = run.analog.empty() ? run.digital : value(next++).number.mantissa();
  if (!run.watchdog.empty()) found_.watchdog = value(next);
  TRY_LET(auto bits,
          plan_->motor->read_bits(tool().device, std::numeric_limits<std::uint16_t>::max()));
  found_.bits = bits;
  return {};
}

std::unique_ptr<device::Stopper> WordSetup::stopper(catalogue::StopMode mode) const {
  auto stopper = std::make_unique<device::CommandWordStopper>(*plan_->motor, mode);
  stopper->started(standard_word(), found_.mode, found_.bits, found_.stopping);
  return stopper;
}

Duration WordSetup::interval(Duration usual) const {
  const auto& watchdog = plan_->watchdog ? plan_->watchdog : found_.watchdog;
  if (!watchdog || watchdog->number == Decimal(0)) return usual;
  const Duration watchdog_period = std::chrono::milliseconds(watchdog->number.mantissa());
  return std::min(usual, watchdog_period / looks_per_watchdog);
}

std::string WordSetup::hint_not_started() const {
  return fmt::format("does {} wait for 'do configure'? is the main power on?", facts().mode);
}

std::string WordSetup::hint_too_fast() const {
  return fmt::format(
      "does the speed of operation data {} come from outside? does {} wait for 'do "
      "configure'?",
      plan_->operation, facts().analog);
}

Parameter WordSetup::written_as(const Parameter& parameter, const Value& before,
                                const Value& value) const {
  const bool halved =
      !facts().group.empty() && is_small(parameter, before) && is_small(parameter, value);
  return halved ? low_half(parameter) : parameter;
}

std::string WordSetup::left_note(const Parameter& parameter) const {
  if (parameter.name != facts().watchdog) return {};
  return "; the driver stops with an alarm when no client asks it";
}

std::uint16_t WordSetup::standard_word() const {
  const catalogue::RunWords& words = facts().modes.at(found_.mode);
  const unsigned run = plan_->options.direction_of_motor == catalogue::Direction::forward
                           ? words.forward
                           : words.reverse;
  return static_cast<std::uint16_t>(run | facts().selecting(plan_->operation));
}

Result<void> WordSetup::check_ready() {
  TRY(check_at_rest());
  if (!facts().modes.contains(found_.mode)) {
    return tl::unexpected(not_ready(
        tool().target,
        fmt::format("{} is {}, which the profile does not know", facts().mode, found_.mode),
        "'spindle get' shows it"));
  }
  return check_inputs().and_then([&] { return check_analog(); });
}

/// A start whose word cannot be made for this driver is none.
Result<void> WordSetup::check_inputs() const {
  const std::uint16_t word = standard_word();
  if (found_.bits.word(word)) return {};
  std::vector<std::int64_t> missing;
  for (const catalogue::InputFunction& function : facts().inputs.functions) {
    if (!function.bit) continue;
    const auto bit = static_cast<std::uint16_t>(1U << *function.bit);
    if ((word & bit) != 0 && !found_.bits.word(bit)) missing.push_back(function.number);
  }
  return tl::unexpected(
      not_ready(tool().target,
                fmt::format("no input of this driver has function {}, which this start needs, so "
                            "the motor was not started",
                            fmt::join(missing, ", ")),
                fmt::format("'spindle get' with '{}' shows what the inputs are assigned to",
                            glob_of(facts().inputs.parameter))));
}

Result<void> WordSetup::check_analog() const {
  const CommandWordSpec& run = facts();
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
Result<void> WordSetup::clear_word() {
  if ((found_.word & found_.bits.any_of(facts().starting)) == 0) return {};
  const auto standard = found_.bits.standard(found_.word);
  cleared_word_ = !standard || plan_->motor->runs(*standard, found_.mode);
  return plan_->motor->command(tool().device, plan_->motor->idle_word());
}

Result<void> WordSetup::write_settings() {
  for (const auto& [parameter, value] : plan_->settings) {
    if (auto written = write_one(parameter, value); !written) {
      return tl::unexpected(of_write(parameter.name, std::move(written.error())));
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

Result<void> WordSetup::set_watchdog() {
  if (!plan_->watchdog) return {};
  return write_one(*plan_->watchdog_parameter, *plan_->watchdog);
}

std::string WordSetup::advice() const {
  const bool is_off = !found_.watchdog || found_.watchdog->number == Decimal(0);
  if (plan_->watchdog || !is_off || !plan_->watchdog_parameter) return {};
  return fmt::format(
      "{}: {} is off: if this computer or the line fails, the motor runs on; with "
      "--watchdog 1s the driver itself stops it",
      tool().target.shown, plan_->watchdog_parameter->name);
}

void WordSetup::add_left(std::vector<Left>& left) const {
  if (!cleared_word_) return;
  left.push_back({.name = facts().command,
                  .set = "no run bit",
                  .before = fmt::format("{:02X}h", found_.word),
                  .trouble = "its run bit would start the motor when a speed is set"});
}

}  // namespace spindle::work
