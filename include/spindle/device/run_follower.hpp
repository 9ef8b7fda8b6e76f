#pragma once

#include <functional>
#include <optional>

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
  std::optional<EventNews> event = std::nullopt;
};

struct FollowOptions {
  std::optional<Duration> limit = std::nullopt;  ///< time allowed, from now
  /// Hears how long the tool has run, several times a second; an error ends the following.
  std::function<Result<void>(Duration elapsed)> progress = {};
};

/// Follows one run of a tool with events, from just before the start until its result: listens,
/// keeps the output armed and reads the running state. Starts and stops nothing.
class RunFollower {
 public:
  RunFollower(Device& device, const catalogue::Action& start, Clock& clock);

  /// Remembers the last event and arms the output. Call before the start.
  Result<void> prepare();

  /// Call after the start. Errors: interrupts and link trouble; what the run did is then unknown.
  Result<FollowedRun> follow(const FollowOptions& options);

  /// An event that came since, such as that of a stop; waits for it a little.
  Result<std::optional<EventNews>> late_event();

  /// Switches the output off again.
  void leave();

 private:
  Result<std::optional<EventNews>> next_event(TimePoint until);
  Result<std::optional<EventNews>> fetch_event();
  Result<std::optional<RunEnding>> look_at_tool();
  [[nodiscard]] bool ends_run(const EventNews& event) const;

  Device* device_;
  const catalogue::Action* start_;
  Clock* clock_;
  EventTracker tracker_ = {};
  std::size_t number_at_ = 0;
  std::size_t kind_at_ = 0;
  TimePoint confirm_by_ = {};
  TimePoint arm_due_ = {};
  bool has_run_ = false;
};

}  // namespace spindle::device
