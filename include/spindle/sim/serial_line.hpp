#pragma once

#include <cstdint>
#include <optional>

#include "spindle/base/bytes.hpp"
#include "spindle/base/clock.hpp"

namespace spindle::sim {

/// How faithfully the line between a client and a simulated serial server is played.
struct LineModel {
  Duration character_time = {};  ///< of each byte, in both directions; zero: bytes take no time
  /// Whether the server is deaf to queries that come too soon, as the real one is; a generic client
  /// keeps too short a silence.
  enum class Gaps : std::uint8_t { enforced, ignored } gaps = Gaps::enforced;
};

/// What was said between two silences.
struct Burst {
  Bytes bytes;
  enum class Timing : std::uint8_t { in_time, too_early } timing = Timing::in_time;
  Duration silence = {};  ///< before a burst that came too early
  TimePoint end = {};     ///< when the silence behind the last byte was complete
};

/// A server's ear on a half-duplex line: silence ends a frame, and a frame that begins before the
/// line was silent for the gap, counted from the last byte in either direction, is not heard. Pure.
class SerialLine {
 public:
  SerialLine(Duration gap, Duration character_time) : gap_(gap), character_time_(character_time) {}

  /// The client's bytes; the first of them begins at `now`.
  void hear(ByteView bytes, TimePoint now);
  /// The server's own last byte has left.
  void spoke(TimePoint now);
  /// When the silence behind what is being heard will be complete; empty while the line is quiet.
  [[nodiscard]] std::optional<TimePoint> silent_at() const;
  /// The burst that has ended by `now`.
  std::optional<Burst> take(TimePoint now);

 private:
  Duration gap_;
  Duration character_time_;
  Burst burst_ = {};
  std::optional<TimePoint> last_byte_ = std::nullopt;  ///< in either direction
};

}  // namespace spindle::sim
