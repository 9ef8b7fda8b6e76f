#include "spindle/device/motor.hpp"

#include <algorithm>
#include <bit>
#include <utility>

namespace spindle::device {
namespace {

using catalogue::Parameter;
using catalogue::RunFacts;
using catalogue::RunWords;
using catalogue::StopMode;

constexpr Duration confirm_interval = std::chrono::milliseconds(50);
/// What a reading before a stop may cost.
constexpr Duration hurried_answer = std::chrono::milliseconds(200);

/// The word that no assignment of inputs takes for a start.
constexpr std::uint16_t no_input = 0;
/// The inputs that one request reads.
constexpr std::uint16_t lower_half = 0x00FF;

// Of the parameters that look() reads; the last two may be missing.
enum Place : std::uint8_t { status_at, command_at, feedback_at, alarm_at, optional_at };

bool has_bit(std::int64_t word, unsigned bit) {
  return ((static_cast<std::uint64_t>(word) >> bit) & 1U) != 0;
}

std::uint16_t joined(unsigned a, unsigned b) { return static_cast<std::uint16_t>(a | b); }

/// In seconds with up to three decimals.
Duration to_duration(const Decimal& seconds) {
  const auto steps = seconds.divided_by(Decimal(1, -3));
  return std::chrono::milliseconds(steps.value_or(0));
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

Result<Motor> Motor::of(const catalogue::Profile& profile) {
  if (!profile.run) {
    return tl::unexpected(Error{.code = Errc::usage,
                                .message = "this product has no motor that a command word runs",
                                .hint = "its profile lacks 'run'",
                                .name = profile.id});
  }
  Motor motor;
  motor.facts_ = *profile.run;
  const RunFacts& facts = motor.facts_;
  for (const std::string* name : {&facts.status, &facts.command_speed, &facts.feedback_speed,
                                  &facts.alarm, &facts.warning, &facts.load}) {
    if (name->empty()) continue;
    auto parameter = profile.find(*name);
    if (!parameter) return tl::unexpected(std::move(parameter.error()));
    motor.parameters_.push_back(catalogue::with_bits_for(std::move(*parameter), std::nullopt));
  }
  if (motor.has_inputs()) {
    for (std::uint16_t n = facts.inputs.first; n <= facts.inputs.last; ++n) {
      auto input = profile.find(catalogue::numbered_name(facts.inputs.parameter, n));
      if (!input) return tl::unexpected(std::move(input.error()));
      motor.inputs_.push_back(std::move(*input));
    }
  }
  const auto command = profile.find(facts.command);
  if (!command) return tl::unexpected(command.error());
  const int low_word = catalogue::register_count(command->encoding.kind) - 1;
  motor.command_register_ = {static_cast<std::uint16_t>(command->address.value + low_word)};
  return motor;
}

Result<MotorState> Motor::state_of(std::span<const Reading> readings, const RunFacts& facts) {
  std::vector<std::int64_t> numbers;
  for (const Reading& reading : readings) {
    if (!reading.value) return tl::unexpected(reading.value.error());
    numbers.push_back(reading.value->number.mantissa());
  }
  MotorState state{.running = has_bit(numbers[status_at], facts.running),
                   .at_speed = has_bit(numbers[status_at], facts.at_speed),
                   .busy = has_bit(numbers[status_at], facts.busy),
                   .command_speed = numbers[command_at],
                   .feedback_speed = numbers[feedback_at],
                   .alarm = numbers[alarm_at]};
  std::size_t next = optional_at;
  if (!facts.warning.empty()) state.warning = numbers[next++];
  if (!facts.load.empty()) state.load = numbers[next++];
  return state;
}

Result<MotorState> Motor::look(Device& device) const {
  const auto readings = device.read_each(parameters_, Limits::skip);
  if (!readings) return tl::unexpected(readings.error());
  return state_of(*readings, facts_);
}

Result<Shown> Motor::stands_still(Device& device) const {
  const auto readings =
      device.read_each({parameters_[status_at], parameters_[command_at]}, Limits::skip);
  if (!readings) return tl::unexpected(readings.error());
  for (const Reading& reading : *readings) {
    if (!reading.value) return tl::unexpected(reading.value.error());
  }
  const bool running = has_bit((*readings)[0].value->number.mantissa(), facts_.running);
  const bool told_to_run = (*readings)[1].value->number != Decimal(0);
  return running || told_to_run ? Shown::no : Shown::yes;
}

bool Motor::runs(std::uint16_t word, std::int64_t mode) const {
  const auto words = facts_.modes.find(mode);
  if (words == facts_.modes.end()) return false;
  const auto& [forward, reverse, decelerate, instant] = words->second;
  const unsigned known = unsigned{forward} | reverse | decelerate | instant;
  return (word & known) == forward || (word & known) == reverse;
}

Result<catalogue::CommandBits> Motor::read_bits(Device& device, std::uint16_t wanted) const {
  if (!has_inputs()) return catalogue::CommandBits();
  const auto end = static_cast<std::size_t>(std::bit_width(joined(wanted, lower_half)));
  const std::size_t first = facts_.inputs.first;
  const std::size_t count = std::min(inputs_.size(), end > first ? end - first : 0);
  const auto readings = device.read_each(
      {inputs_.begin(), inputs_.begin() + static_cast<std::ptrdiff_t>(count)}, Limits::skip);
  if (!readings) return tl::unexpected(readings.error());
  std::vector<std::int64_t> numbers;
  for (const Reading& reading : *readings) {
    if (!reading.value) return tl::unexpected(reading.value.error());
    numbers.push_back(reading.value->number.mantissa());
  }
  return catalogue::CommandBits(facts_.inputs, numbers);
}

std::uint16_t Motor::idle_word() const { return has_inputs() ? no_input : facts_.instant_always; }

Result<void> Motor::command(Device& device, std::uint16_t word) const {
  return device.write_word(command_register_, word);
}

Result<void> Motor::broadcast(Device& device, std::uint16_t word) const {
  return device.broadcast_word(command_register_, word);
}

void MotorStopper::started(std::uint16_t word, std::int64_t mode,
                           const catalogue::CommandBits& bits, Duration stopping) {
  started_by_ = word;
  input_mode_ = mode;
  bits_ = bits;
  stopping_ = stopping;
  knows_stopping_ = true;
}

void MotorStopper::observe(Device& device) {
  stopping_ = longest_stop(device.profile());
  link::Session& session = device.session();
  const Duration patience = session.options().answer_timeout;
  session.set_answer_timeout(std::min(patience, hurried_answer));
  observe_run(device);
  session.set_answer_timeout(patience);
}

/// Nothing more is asked of a motor that stands still: the word without any bit is right for it.
void MotorStopper::observe_run(Device& device) {
  const RunFacts& facts = motor_->facts();
  const auto read = [&](const std::vector<std::string>& names) -> std::vector<std::int64_t> {
    auto wanted = device.profile().select(names);
    if (!wanted) return {};
    for (Parameter& parameter : *wanted) {  // no names of bits, for which the mode would be read
      parameter = catalogue::with_bits_for(std::move(parameter), std::nullopt);
    }
    const auto readings = device.read_each(*wanted, Limits::skip);
    if (!readings) return {};
    std::vector<std::int64_t> numbers;
    for (const Reading& reading : *readings) {
      if (!reading.value) return {};
      numbers.push_back(reading.value->number.mantissa());
    }
    return numbers;
  };
  const auto state = read({facts.command, facts.status});
  if (state.empty() || !has_bit(state[1], facts.running)) return;
  const auto mode = read({facts.mode});
  if (mode.empty()) return;
  const auto word = static_cast<std::uint16_t>(state[0]);
  const auto bits = motor_->read_bits(device, word);
  if (!bits) return;
  const auto standard = bits->standard(word);
  if (!standard) return;
  started_by_ = *standard;
  input_mode_ = mode[0];
  bits_ = *bits;
  seen_running_ = true;
}

/// After the stop was sent: a stop does not wait for it.
void MotorStopper::read_stopping(Device& device) {
  if (std::exchange(knows_stopping_, true)) return;
  const RunFacts& facts = motor_->facts();
  const auto operation = static_cast<std::uint16_t>(
      (started_by_ & facts.select) >> static_cast<unsigned>(std::countr_zero(facts.select)));
  const auto time =
      device.profile().select({catalogue::numbered_name(facts.deceleration, operation)});
  if (!time) return;
  const auto read = device.read_each(*time, Limits::skip);
  if (read) stopping_ = time_of(read->front(), stopping_);
}

/// In bits of the profile.
std::uint16_t MotorStopper::standard_word() const {
  const RunFacts& facts = motor_->facts();
  if (harder_) return facts.instant_always;
  const bool gently = mode_ == StopMode::decelerate;
  const unsigned operation = unsigned{started_by_} & facts.select;
  const bool trusted = seen_running_ && input_mode_ && motor_->runs(started_by_, *input_mode_);
  if (!trusted) return joined(gently ? facts.decelerate_always : facts.instant_always, operation);
  const RunWords& words = facts.modes.at(*input_mode_);
  return joined(gently ? words.decelerate : words.instant, operation);
}

std::uint16_t MotorStopper::word() const {
  if (!motor_->has_inputs()) return standard_word();
  if (harder_ || !bits_) return no_input;
  return bits_->word(standard_word()).value_or(no_input);
}

Result<StopResult> MotorStopper::stop(Device& device, Clock& clock) {
  auto sent = send(device);
  if (!sent) return tl::unexpected(std::move(sent.error()));
  const bool is_informed = !motor_->has_inputs() || bits_.has_value();
  const bool gently = mode_ == StopMode::decelerate && !harder_ && is_informed;
  if (gently) read_stopping(device);
  const Duration needed = gently ? stopping_ : Duration::zero();
  const TimePoint deadline = clock.now() + needed + device.session().options().answer_timeout;
  auto stopped = await_standstill(device, clock, deadline);
  if (stopped == StopResult::unconfirmed) harder_ = true;
  return stopped;
}

Result<StopResult> MotorStopper::await_standstill(Device& device, Clock& clock,
                                                  TimePoint deadline) const {
  bool forgiving = true;  // of one lost answer: the stop itself was acknowledged
  while (true) {
    auto still = motor_->stands_still(device);
    const bool lost = !still && link::is_lost_answer(still.error());
    if (lost && std::exchange(forgiving, false)) continue;
    if (!still) return tl::unexpected(std::move(still.error()));
    if (*still == Shown::yes) return StopResult::confirmed;
    const TimePoint next = clock.now() + confirm_interval;
    if (next > deadline) return StopResult::unconfirmed;
    if (auto slept = clock.sleep_until(next); !slept) return tl::unexpected(slept.error());
  }
}

Duration time_of(const Reading& reading, Duration fallback) {
  return reading.value ? to_duration(reading.value->number) : fallback;
}

Duration longest_stop(const catalogue::Profile& profile) {
  if (!profile.run) return {};
  const auto time =
      profile.find(catalogue::numbered_name(profile.run->deceleration, profile.run->first));
  if (!time || !time->range.maximum) return {};
  return to_duration(*time->range.maximum);
}

}  // namespace spindle::device
