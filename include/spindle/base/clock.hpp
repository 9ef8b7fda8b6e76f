#pragma once

#include <chrono>

#include "spindle/base/error.hpp"

namespace spindle {

using Duration = std::chrono::nanoseconds;
using TimePoint = std::chrono::time_point<std::chrono::steady_clock, Duration>;
using WallTime = std::chrono::time_point<std::chrono::system_clock, std::chrono::milliseconds>;

/// Where the program gets its time from. The real one is in `posix`; tests move theirs by hand.
class Clock {
 public:
  Clock() = default;
  Clock(const Clock&) = delete;
  Clock& operator=(const Clock&) = delete;
  virtual ~Clock() = default;

  /// Monotonic; never jumps. All deadlines are measured with it.
  [[nodiscard]] virtual TimePoint now() const = 0;

  /// Calendar time (UTC), for records and files only.
  [[nodiscard]] virtual WallTime wall() const = 0;

  /// How far the clocks of the user's zone are ahead of UTC at a moment.
  [[nodiscard]] virtual std::chrono::seconds utc_offset(WallTime /*time*/) const { return {}; }

  /// Returns at `deadline`, or early with `Errc::interrupted` when a signal asked the program to
  /// end.
  virtual Result<void> sleep_until(TimePoint deadline) = 0;
};

}  // namespace spindle
