#include "spindle/device/command_word.hpp"

#include <algorithm>
#include <bit>
#include <utility>

#include "standstill.hpp"

namespace spindle::device {
namespace {

using catalogue::CommandWordSpec;
using catalogue::Parameter;
using catalogue::RunWords;
using catalogue::StopMode;

/// What a reading before a stop may cost.
constexpr Duration hurried_answer = std::chrono::milliseconds(200);

/// The word that no assignment of inputs takes for a start.
constexpr std::uint16_t no_input = 0;
/// The inputs that one request reads.
constexpr std::uint16_t lower_half = 0x00FF;

bool has_bit(std::int64_t word, std::optional<std::uint8_t> bit) {
  return bit && ((static_cast<std::uint64_t>(word) >> *bit) & 1U) != 0;
}

std::uint16_t joined(unsigned a, unsigned b) { return static_cast<std::uint16_t>(a | b); }

}  // namespace

CommandWord::CommandWord(const CommandWordSpec& facts, MotorMonitor monitor)
    : facts_(facts), monitor_(std::move(monitor)) {}

CommandWord::CommandWord(CommandWord&& other) noexcept
    : facts_(std::move(other.facts_)),
      monitor_(std::move(other.monitor_)),
      inputs_(std::move(other.inputs_)),
      command_register_(other.command_register_) {}

Result<CommandWord> CommandWord::of(const catalogue::Profile& profile) {
  const CommandWordSpec* facts = profile.run ? profile.run->word() : nullptr;
  if (facts == nullptr) {
    return tl::unexpected(Error{.code = Errc::usage,
                                .message = "this product has no motor that a command word runs",
                                .hint = "its profile lacks 'run'",
                                .name = profile.id});
  }
  TRY_LET(auto monitor, MotorMonitor::of(facts->monitor, profile));
  CommandWord motor(*facts, std::move(monitor));
  if (motor.has_inputs()) {
    for (std::uint16_t n = facts->inputs.first; n <= facts->inputs.last; ++n) {
      TRY_LET(auto input, profile.find(catalogue::numbered_name(facts->inputs.parameter, n)));
      motor.inputs_.push_back(std::move(input));
    }
  }
  TRY_LET(const auto command, profile.find(facts->command));
  const int low_word = catalogue::register_count(command.encoding) - 1;
  motor.command_register_ = {static_cast<std::uint16_t>(command.address.value + low_word)};
  return motor;
}

std::unique_ptr<Stopper> CommandWord::stopper(StopMode mode) const {
  return std::make_unique<CommandWordStopper>(*this, mode);
}

/// Which bit starts what on each of them cannot be asked.
Result<void> CommandWord::broadcast_stop(Device& device, StopMode mode) const {
  const bool gently = mode == StopMode::decelerate && !has_inputs();
  return device.broadcast_word(command_register_, gently ? facts_.decelerate_always : idle_word());
}

bool CommandWord::runs(std::uint16_t word, std::int64_t mode) const {
  const catalogue::RunWords* words = facts_.modes.find(mode);
  if (words == nullptr) return false;
  const auto& [forward, reverse, decelerate, instant] = *words;
  const unsigned known = unsigned{forward} | reverse | decelerate | instant;
  return (word & known) == forward || (word & known) == reverse;
}

Result<catalogue::CommandBits> CommandWord::read_bits(Device& device, std::uint16_t wanted) const {
  if (!has_inputs()) return catalogue::CommandBits();
  const auto end = static_cast<std::size_t>(std::bit_width(joined(wanted, lower_half)));
  const std::size_t first = facts_.inputs.first;
  const std::size_t count = std::min(inputs_.size(), end > first ? end - first : 0);
  TRY_LET(const auto readings,
          device.read_each({inputs_.begin(), inputs_.begin() + static_cast<std::ptrdiff_t>(count)},
                           Limits::skip));
  std::vector<std::int64_t> numbers;
  for (const Reading& reading : readings) {
    if (!reading.value) return tl::unexpected(reading.value.error());
    numbers.push_back(reading.value->number.mantissa());
  }
  return catalogue::CommandBits(facts_.inputs, numbers);
}

std::uint16_t CommandWord::idle_word() const {
  return has_inputs() ? no_input : facts_.instant_always;
}

Result<void> CommandWord::command(Device& device, std::uint16_t word) const {
  return device.write_word(command_register_, word);
}

void CommandWordStopper::started(std::uint16_t word, std::int64_t mode,
                                 const catalogue::CommandBits& bits, Duration stopping) {
  started_by_ = word;
  input_mode_ = mode;
  bits_ = bits;
  stopping_ = stopping;
  knows_stopping_ = true;
}

void CommandWordStopper::observe(Device& device) {
  stopping_ = longest_stop(device.profile());
  link::Session& session = device.session();
  const Duration patience = session.options().answer_timeout;
  session.set_answer_timeout(std::min(patience, hurried_answer));
  observe_run(device);
  session.set_answer_timeout(patience);
}

/// Nothing more is asked of a motor that stands still: the word without any bit is right for it.
void CommandWordStopper::observe_run(Device& device) {
  const CommandWordSpec& facts = motor_->facts();
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
  const auto state = read({facts.command, facts.monitor.status});
  if (state.empty() || !has_bit(state[1], facts.monitor.running)) return;
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
void CommandWordStopper::read_stopping(Device& device) {
  if (std::exchange(knows_stopping_, true)) return;
  const CommandWordSpec& facts = motor_->facts();
  const auto operation = static_cast<std::uint16_t>(
      (started_by_ & facts.select) >> static_cast<unsigned>(std::countr_zero(facts.select)));
  const auto time =
      device.profile().select({catalogue::numbered_name(facts.deceleration, operation)});
  if (!time) return;
  const auto read = device.read_each(*time, Limits::skip);
  if (read) stopping_ = time_of(read->front(), stopping_);
}

/// In bits of the profile.
std::uint16_t CommandWordStopper::standard_word() const {
  const CommandWordSpec& facts = motor_->facts();
  if (harder_) return facts.instant_always;
  const bool gently = mode_ == StopMode::decelerate;
  const unsigned operation = unsigned{started_by_} & facts.select;
  const bool trusted = seen_running_ && input_mode_ && motor_->runs(started_by_, *input_mode_);
  if (!trusted) return joined(gently ? facts.decelerate_always : facts.instant_always, operation);
  const RunWords& words = facts.modes.at(*input_mode_);
  return joined(gently ? words.decelerate : words.instant, operation);
}

std::uint16_t CommandWordStopper::word() const {
  if (!motor_->has_inputs()) return standard_word();
  if (harder_ || !bits_) return no_input;
  return bits_->word(standard_word()).value_or(no_input);
}

Result<StopResult> CommandWordStopper::stop(Device& device, Clock& clock) {
  auto sent = send(device);
  if (!sent) return tl::unexpected(std::move(sent.error()));
  const bool is_informed = !motor_->has_inputs() || bits_.has_value();
  const bool gently = mode_ == StopMode::decelerate && !harder_ && is_informed;
  if (gently) read_stopping(device);
  const Duration needed = gently ? stopping_ : Duration::zero();
  const TimePoint deadline = clock.now() + needed + device.session().options().answer_timeout;
  auto stopped = await_standstill(*motor_->monitor(), device, clock, deadline);
  if (stopped == StopResult::unconfirmed) harder_ = true;
  return stopped;
}

Duration longest_stop(const catalogue::Profile& profile) {
  const CommandWordSpec* facts = profile.run ? profile.run->word() : nullptr;
  if (facts == nullptr) return {};
  const auto time = profile.find(catalogue::numbered_name(facts->deceleration, facts->first));
  if (!time || !time->range.maximum) return {};
  return time_of(
      {.parameter = *time, .registers = {}, .value = catalogue::Value{*time->range.maximum, {}}},
      {});
}

}  // namespace spindle::device
