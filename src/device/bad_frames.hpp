#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "spindle/base/clock.hpp"
#include "spindle/link/session.hpp"

namespace spindle::device {

/// Frames that came unasked and cannot be what they say they are. The first is told at once; of a
/// line that is full of them it is told once in a while, and none is left untold.
class BadFrames {
 public:
  /// What there is to tell of them, all that were not told yet in one sentence.
  struct News {
    std::string reason;
    WallTime time;  ///< when the last one came
  };

  /// Counts one. Empty while it waits to be told with others.
  std::optional<News> note(const link::Spontaneous& frame, const std::string& why, TimePoint now);

  /// Those that have waited long enough.
  std::optional<News> due(TimePoint now);

  /// All that wait, at the end of a connection or of the watch.
  std::optional<News> rest();

  /// When due() has something to tell; TimePoint::max(): never.
  [[nodiscard]] TimePoint next_due() const;

 private:
  std::size_t untold_ = 0;
  std::uint8_t function_ = 0;  ///< of the last one
  std::string why_ = {};
  WallTime time_ = {};
  std::optional<TimePoint> told_at_ = std::nullopt;
};

}  // namespace spindle::device
