#include "spindle/device/run_follower.hpp"

#include <algorithm>
#include <utility>

#include "spindle/modbus/pdu.hpp"

namespace spindle::device {
namespace {

/// How often the running state is read.
constexpr Duration look_interval = std::chrono::milliseconds(100);
/// How long the event of a run that ended may still be on its way.
constexpr Duration event_grace = std::chrono::milliseconds(500);

}  // namespace

RunFollower::RunFollower(Device& device, const catalogue::Action& start, Clock& clock)
    : device_(&device), start_(&start), clock_(&clock) {
  const catalogue::Profile& profile = device.profile();
  const auto index_of = [&](const std::string& name) -> std::size_t {
    const auto parameter = profile.find(name);
    return parameter ? parameter->address.value - profile.events->first : 0U;
  };
  number_at_ = index_of(profile.events->number);
  kind_at_ = index_of(profile.events->kind);
}

Result<void> RunFollower::prepare() {
  const auto number = device_->event_number();
  if (!number) return tl::unexpected(number.error());
  tracker_.set_baseline(*number);
  arm_due_ = clock_->now() + device_->profile().events->arm_every;
  return device_->switch_events(EventOutput::on);
}

Result<FollowedRun> RunFollower::follow(const FollowOptions& options) {
  const TimePoint began = clock_->now();
  const TimePoint deadline = options.limit ? began + *options.limit : TimePoint::max();
  confirm_by_ = began + device_->session().options().answer_timeout;
  while (clock_->now() < deadline) {
    auto event = next_event(std::min(deadline, clock_->now() + look_interval));
    if (!event) return tl::unexpected(std::move(event.error()));
    if (*event && ends_run(**event)) return FollowedRun{RunEnding::result, std::move(*event)};
    auto ending = look_at_tool();
    if (!ending) return tl::unexpected(std::move(ending.error()));
    if (*ending == RunEnding::ended) {
      event = late_event();
      if (!event) return tl::unexpected(std::move(event.error()));
      return FollowedRun{*event ? RunEnding::result : RunEnding::ended, std::move(*event)};
    }
    if (*ending) return FollowedRun{**ending};
    if (!options.progress) continue;
    if (auto told = options.progress(clock_->now() - began); !told) {
      return tl::unexpected(std::move(told.error()));
    }
  }
  return FollowedRun{RunEnding::elapsed};
}

/// Reads whether the tool runs, and keeps its output armed.
Result<std::optional<RunEnding>> RunFollower::look_at_tool() {
  if (clock_->now() >= arm_due_) {
    arm_due_ = clock_->now() + device_->profile().events->arm_every;
    if (auto armed = device_->switch_events(EventOutput::on); !armed) {
      return tl::unexpected(std::move(armed.error()));
    }
  }
  const auto running = device_->shows(start_->confirm, *start_->value);
  if (!running) return tl::unexpected(running.error());
  if (*running == Shown::yes) {
    has_run_ = true;
    return std::nullopt;
  }
  if (has_run_) return RunEnding::ended;
  // A run may be over before anybody looked: then its event is there.
  if (clock_->now() < confirm_by_) return std::nullopt;
  return RunEnding::ignored;
}

Result<std::optional<EventNews>> RunFollower::next_event(TimePoint until) {
  while (true) {
    auto frame = device_->session().next_spontaneous(until);
    if (!frame) return tl::unexpected(std::move(frame.error()));
    if (!*frame) return std::nullopt;
    Registers block = modbus::registers_of((*frame)->pdu);
    if (!tracker_.track(block[number_at_], block).is_new()) continue;
    return EventNews{EventSource::push, std::move(block), (*frame)->wall};
  }
}

Result<std::optional<EventNews>> RunFollower::fetch_event() {
  auto block = device_->last_event();
  if (!block) return tl::unexpected(std::move(block.error()));
  if (!tracker_.track((*block)[number_at_], *block).is_new()) return std::nullopt;
  return EventNews{EventSource::catch_up, std::move(*block), clock_->wall()};
}

Result<std::optional<EventNews>> RunFollower::late_event() {
  const TimePoint until = clock_->now() + event_grace;
  while (true) {
    auto event = next_event(until);
    if (!event || !*event) break;
    if (ends_run(**event)) return event;
  }
  return fetch_event();
}

bool RunFollower::ends_run(const EventNews& event) const {
  const auto& kinds = device_->profile().events->kinds;
  const auto kind = kinds.find(event.block[kind_at_]);
  if (kind == kinds.end()) return false;
  return kind->second == "fastening-ok" || kind->second == "fastening-ng" ||
         kind->second == "error";
}

void RunFollower::leave() {
  // The tool switches itself off when it hears nothing; a lost farewell costs only time.
  const auto ignored = device_->switch_events(EventOutput::off);
  static_cast<void>(ignored);
}

}  // namespace spindle::device
