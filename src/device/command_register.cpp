#include "spindle/device/command_register.hpp"

#include <algorithm>
#include <utility>

#include "standstill.hpp"

namespace spindle::device {
namespace {

using catalogue::CommandRegisterSpec;
using catalogue::StopMode;

/// What a reading before a stop may cost.
constexpr Duration hurried_answer = std::chrono::milliseconds(200);

}  // namespace

CommandRegister::CommandRegister(const CommandRegisterSpec& facts, catalogue::Parameter command)
    : facts_(facts), command_(std::move(command)) {}

CommandRegister::CommandRegister(CommandRegister&& other) noexcept
    : facts_(std::move(other.facts_)),
      command_(std::move(other.command_)),
      stop_(std::move(other.stop_)),
      monitor_(std::move(other.monitor_)) {}

Result<CommandRegister> CommandRegister::of(const catalogue::Profile& profile) {
  const CommandRegisterSpec& facts = *profile.run->command_register();
  TRY_LET(auto command, profile.find(facts.command));
  CommandRegister model(facts, std::move(command));
  if (!facts.stop_register.empty()) {
    TRY_LET(auto stop, profile.find(facts.stop_register));
    model.stop_ = std::move(stop);
  }
  const catalogue::MonitorSpec& monitor = facts.monitor;
  if (monitor.status.empty() && monitor.command_speed.empty() && monitor.feedback_speed.empty()) {
    return model;
  }
  TRY_LET(auto made, MotorMonitor::of(monitor, profile));
  model.monitor_ = std::move(made);
  return model;
}

std::unique_ptr<Stopper> CommandRegister::stopper(StopMode mode) const {
  return std::make_unique<CommandRegisterStopper>(*this, mode);
}

std::uint32_t CommandRegister::enabling_bit() const {
  const catalogue::EnableSpec& enable = facts_.enable;
  return enable.bit && enable.parameter == facts_.command ? std::uint32_t{1} << *enable.bit : 0;
}

std::optional<std::uint32_t> CommandRegister::stop_value(StopMode mode) const {
  return mode == StopMode::instant && facts_.instant ? facts_.instant : facts_.stop;
}

Result<void> CommandRegister::command(Device& device, std::uint32_t value) const {
  return device.send(command_, Decimal(value));
}

/// The command is what holds the motor stopped, so its acknowledgement is the one that counts.
Result<void> CommandRegister::send_stop(Device& device, StopMode mode,
                                        std::uint32_t enabling) const {
  Result<void> sent;
  if (stop_) sent = device.send(*stop_, Decimal(facts_.stop_value));
  const auto value = stop_value(mode);
  if (!value) return sent;
  return command(device, *value | enabling);
}

Result<void> CommandRegister::broadcast_stop(Device& device, StopMode mode) const {
  Result<void> sent;
  if (stop_) sent = device.broadcast(*stop_, {Decimal(facts_.stop_value), {}});
  const auto value = stop_value(mode);
  if (!value) return sent;
  return device.broadcast(command_, {Decimal(*value), {}});
}

void CommandRegisterStopper::observe(Device& device) {
  if (model_->enabling_bit() == 0) return;
  link::Session& session = device.session();
  const Duration patience = session.options().answer_timeout;
  session.set_answer_timeout(std::min(patience, hurried_answer));
  const auto readings = device.read_each({model_->command_parameter()}, Limits::skip);
  session.set_answer_timeout(patience);
  if (!readings || !readings->front().value) return;
  const auto value = static_cast<std::uint32_t>(readings->front().value->number.mantissa());
  enabling_ = value & model_->enabling_bit();
}

Result<void> CommandRegisterStopper::send(Device& device) {
  return model_->send_stop(device, mode_, enabling_);
}

Result<StopResult> CommandRegisterStopper::stop(Device& device, Clock& clock) {
  auto sent = send(device);
  if (!sent) return tl::unexpected(std::move(sent.error()));
  const MotorMonitor* monitor = model_->monitor();
  if (monitor == nullptr) return StopResult::sent;
  const TimePoint deadline =
      clock.now() + model_->facts().stopping + device.session().options().answer_timeout;
  auto stopped = await_standstill(*monitor, device, clock, deadline);
  if (stopped == StopResult::unconfirmed) mode_ = StopMode::instant;  // the gentle one did not help
  return stopped;
}

}  // namespace spindle::device
