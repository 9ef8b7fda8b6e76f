#include "spindle/device/run_follower.hpp"

#include <algorithm>
#include <utility>

#include "spindle/modbus/pdu.hpp"

namespace spindle::device {
namespace {

using catalogue::EventKind;

/// How often the running state is read.
constexpr Duration look_interval = std::chrono::milliseconds(100);
/// How long the event of a run that ended may still be on its way.
constexpr Duration event_grace = std::chrono::milliseconds(500);
/// A motor runs: one lost answer is forgiven, however often the user lets reads be repeated.
constexpr unsigned retries_while_running = 1;

bool is_result(std::optional<EventKind> kind) {
  return kind == EventKind::fastening_ok || kind == EventKind::fastening_ng ||
         kind == EventKind::error;
}

}  // namespace

RunFollower::RunFollower(Device& device, const catalogue::Action& start, Clock& clock,
                         HandleEvent handle)
    : device_(&device),
      start_(&start),
      clock_(&clock),
      handle_(std::move(handle)),
      layout_(device.profile()),
      answer_timeout_(device.session().options().answer_timeout) {}

Result<void> RunFollower::prepare() {
  if (!device_->profile().events->first) {
    return tl::unexpected(
        Error{.code = Errc::usage,
              .message =
                  "where its last event can be read is not known, so the result of this run cannot "
                  "be told from an older one",
              .hint = "start it at the tool, and watch it with 'spindle watch'",
              .name = start_->name});
  }
  if (device_->profile().events->number.empty()) {
    return tl::unexpected(
        Error{.code = Errc::usage,
              .message = "the tool does not count its results, so that of this run cannot be known",
              .hint = "start it at the tool, and watch it with 'spindle watch'",
              .name = start_->name});
  }
  TRY_LET(const auto number, device_->event_number());
  tracker_.set_baseline(number);
  return arm();
}

/// The next time is due before the output expires; never where nothing arms it.
Result<void> RunFollower::arm() {
  const auto& arming = device_->profile().events->arm;
  arm_due_ = arming ? clock_->now() + arming->every : TimePoint::max();
  return device_->switch_events(EventOutput::on);
}

Result<FollowedRun> RunFollower::follow(const FollowOptions& options) {
  const TimePoint began = clock_->now();
  confirm_by_ = began + answer_timeout_;
  device_->set_retries(retries_while_running);
  while (clock_->now() < options.deadline) {
    auto over = step(options.deadline);
    if (!over && is_cut_short(over.error(), options.deadline)) break;
    if (!over) return tl::unexpected(std::move(over.error()));
    if (*over) return std::move(**over);
    if (!options.progress) continue;
    TRY(options.progress(clock_->now() - began));
  }
  return FollowedRun{RunEnding::elapsed};
}

/// An answer that is not there, or not whole, when the time is over.
bool RunFollower::is_cut_short(const Error& error, TimePoint deadline) const {
  return link::is_lost_answer(error) && clock_->now() >= deadline;
}

/// Listens for a while, then looks; empty while the run goes on.
Result<std::optional<FollowedRun>> RunFollower::step(TimePoint deadline) {
  auto event = next_result(std::min(deadline, clock_->now() + look_interval));
  if (!event) return tl::unexpected(std::move(event.error()));
  if (*event) return FollowedRun{RunEnding::result, std::move(*event)};
  // Time enough for one repetition before the deadline.
  const Duration left = std::max(Duration::zero(), deadline - clock_->now());
  device_->session().set_answer_timeout(std::min(answer_timeout_, left / 2));
  const auto ending = look_at_tool();
  device_->session().set_answer_timeout(answer_timeout_);
  if (!ending) return tl::unexpected(ending.error());
  if (!*ending) return std::nullopt;
  if (*ending != RunEnding::ended) return FollowedRun{**ending};
  event = late_event();
  if (!event) return tl::unexpected(std::move(event.error()));
  return FollowedRun{*event ? RunEnding::result : RunEnding::ended, std::move(*event)};
}

Result<void> RunFollower::keep_armed() { return clock_->now() < arm_due_ ? Result<void>() : arm(); }

/// Reads whether the tool runs, and keeps its output armed.
Result<std::optional<RunEnding>> RunFollower::look_at_tool() {
  TRY(keep_armed());
  TRY_LET(const auto running, device_->shows(start_->confirm, *start_->value));
  if (running == Shown::yes) {
    has_run_ = true;
    return std::nullopt;
  }
  if (has_run_) return RunEnding::ended;
  // A run may be over before the program looked: then its event is there.
  if (clock_->now() < confirm_by_) return std::nullopt;
  return RunEnding::ignored;
}

Result<std::optional<ToolEvent>> RunFollower::next_result(TimePoint until) {
  // Frames without end must not keep it; what is left of them is there for the next who listens.
  do {
    TRY_LET(auto frame, device_->session().next_spontaneous(until));
    if (!frame) return std::nullopt;
    auto result = filter_result({EventOrigin::push, modbus::registers_of(frame->pdu), frame->wall});
    if (result) return result;
  } while (clock_->now() < until);
  return std::nullopt;
}

Result<std::optional<ToolEvent>> RunFollower::fetch_result() {
  TRY_LET(auto block, device_->last_event());
  if (!block) return std::nullopt;
  return filter_result({EventOrigin::catch_up, std::move(*block), clock_->wall()});
}

/// Gives back a new event that is a result. Another one may be all that a run leaves behind:
/// loosening ends neither well nor badly.
std::optional<ToolEvent> RunFollower::filter_result(ToolEvent event) {
  const Tracked tracked = tracker_.track(layout_.number_of(event.block), event.block);
  // A tool that was switched off and on has had no event at all, or one that it remembers: none
  // that says how this run ended.
  const bool restarted = tracked.novelty == Sequence::restart;
  if (!tracked.is_new() || restarted || EventTracker::is_blank(event.block)) return std::nullopt;
  if (handle_) handle_(event);
  const auto kind = layout_.kind_of(event.block);
  if (is_result(kind)) return event;
  if (kind == EventKind::other) other_ = std::move(event);
  return std::nullopt;
}

Result<std::optional<ToolEvent>> RunFollower::late_event() {
  auto event = next_result(clock_->now() + event_grace);
  if (!event || !*event) event = fetch_result();
  if (event && !*event) return std::exchange(other_, std::nullopt);
  return event;
}

void RunFollower::disarm() {
  // The tool switches itself off when it hears nothing; a lost farewell costs only time.
  const auto ignored = device_->switch_events(EventOutput::off);
  static_cast<void>(ignored);
}

}  // namespace spindle::device
