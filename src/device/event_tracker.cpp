#include "spindle/device/event_tracker.hpp"

#include <algorithm>

namespace spindle::device {
namespace {

/// How many blocks are remembered to know a repeat that comes late.
constexpr std::size_t remembered = 16;

/// A smaller number is taken for a wrap when the counter was this near its end and is this near its
/// start; farther off it is a tool that began to count anew.
constexpr std::uint32_t wrap_reach = 1024;

constexpr std::uint32_t numbers = 65536;

}  // namespace

bool EventTracker::is_blank(RegisterView block) {
  return std::all_of(block.begin(), block.end(), [](std::uint16_t word) { return word == 0; });
}

Tracked EventTracker::judge(std::uint16_t number, RegisterView block) const {
  if (!last_) return {Novelty::baseline};
  const std::uint32_t step = (number + numbers - *last_) % numbers;
  if (step == 0) return {Novelty::repeat};
  if (number > *last_) {
    return step == 1 ? Tracked{Novelty::next} : Tracked{Novelty::jump, step - 1};
  }
  if (step <= wrap_reach && !is_blank(block)) return {Novelty::wrap, step - 1};
  return {Novelty::restart};
}

Tracked EventTracker::track(std::uint16_t number, RegisterView block) {
  const bool known = std::any_of(recent_.begin(), recent_.end(), [&](const Registers& earlier) {
    return std::equal(earlier.begin(), earlier.end(), block.begin(), block.end());
  });
  if (known) return {Novelty::repeat};
  const Tracked tracked = judge(number, block);
  last_ = number;
  recent_.emplace_back(block.begin(), block.end());
  if (recent_.size() > remembered) recent_.pop_front();
  return tracked;
}

}  // namespace spindle::device
