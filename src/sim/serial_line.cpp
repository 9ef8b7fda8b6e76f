#include "spindle/sim/serial_line.hpp"

#include <algorithm>
#include <utility>

namespace spindle::sim {

void SerialLine::hear(ByteView bytes, TimePoint now) {
  if (burst_.bytes.empty()) {
    const bool early = last_byte_ && now < *last_byte_ + gap_;
    burst_.timing = early ? Burst::Timing::too_early : Burst::Timing::in_time;
    if (early) burst_.silence = std::max(now - *last_byte_, Duration::zero());
  }
  burst_.bytes.insert(burst_.bytes.end(), bytes.begin(), bytes.end());
  const TimePoint begin = std::max(now, last_byte_.value_or(now));
  last_byte_ = begin + character_time_ * static_cast<Duration::rep>(bytes.size());
}

void SerialLine::spoke(TimePoint now) { last_byte_ = std::max(now, last_byte_.value_or(now)); }

std::optional<TimePoint> SerialLine::silent_at() const {
  if (burst_.bytes.empty()) return std::nullopt;
  return *last_byte_ + gap_;
}

std::optional<Burst> SerialLine::take(TimePoint now) {
  const auto end = silent_at();
  if (!end || now < *end) return std::nullopt;
  burst_.end = *end;
  return std::exchange(burst_, Burst());
}

}  // namespace spindle::sim
