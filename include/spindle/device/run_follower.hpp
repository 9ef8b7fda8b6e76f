#pragma once

#include <functional>
#include <optional>

#include "spindle/catalogue/event_layout.hpp"
#include "spindle/device/device.hpp"
#include "spindle/device/event_tracker.hpp"
#include "spindle/device/watcher.hpp"

namespace spindle::device {

/// Why a followed run is over.
enum class RunEnding : std::uint8_t {
  result,   ///< an event says how it ended
  ended,    ///< the tool says that it no longer runs, and no event came
  elapsed,  ///< the time allowed is over; it may still run
  ignored,  ///< the start was acknowledged, but the tool does not run
};

struct FollowedRun {
  RunEnding ending;
  std::optional<ToolEvent> event = std::nullopt;
};

struct FollowOptions {
  TimePoint deadline = TimePoint::max();  ///< end of the time allowed
  /// Hears how long the tool has run, several times a second; an error ends the following.
  std::function<Result<void>(Duration elapsed)> progress = {};
};

/// Hears every new event of a run when it becomes known, the result among them.
using HandleEvent = std::function<void(const ToolEvent&)>;

/// Follows one run of a tool with events, from just before the start until its result: listens,
/// keeps the output armed and reads the running state. Starts and stops nothing. Its time limits
/// hold however many frames the tool sends.
class RunFollower {
 public:
  /// `start` must outlive it. `handle` may be empty, and must not use the device.
  RunFollower(Device& device, const catalogue::Action& start, Clock& clock,
              HandleEvent handle = {});

  /// Remembers the last event and arms the output. Call before the start. Error `usage`, before the
  /// tool is asked, where the profile names no counter of events.
  Result<void> prepare();

  /// Call after the start. Errors: interrupts and link trouble; what the run did is then unknown. A
  /// tool that falls silent is not waited for beyond the deadline.
  Result<FollowedRun> follow(const FollowOptions& options);

  /// The event of a run that is over, such as that of a stop; waits for it a little.
  Result<std::optional<ToolEvent>> late_event();

  /// Switches the output off again.
  void disarm();

 private:
  Result<std::optional<FollowedRun>> step(TimePoint deadline);
  Result<std::optional<ToolEvent>> next_result(TimePoint until);
  Result<std::optional<ToolEvent>> fetch_result();
  std::optional<ToolEvent> filter_result(ToolEvent event);
  [[nodiscard]] bool is_cut_short(const Error& error, TimePoint deadline) const;
  Result<std::optional<RunEnding>> look_at_tool();
  Result<void> arm();
  Result<void> keep_armed();

  Device* device_;
  const catalogue::Action* start_;
  Clock* clock_;
  HandleEvent handle_;
  catalogue::EventLayout layout_;
  EventTracker tracker_ = {};
  Duration answer_timeout_ = {};  ///< the user's or the profile's
  TimePoint confirm_by_ = {};
  TimePoint arm_due_ = {};
  bool has_run_ = false;
  std::optional<ToolEvent> other_ = std::nullopt;  ///< the last event that is no result
};

}  // namespace spindle::device
