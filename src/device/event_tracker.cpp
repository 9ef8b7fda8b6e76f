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

/// How far a tool that began to count anew can have come: soon so far, and then no faster than
/// this. Generous, because a doubt too many costs a line, and one too few hides lost results.
constexpr std::int64_t soon_reached = 256;
constexpr Duration fastest_event = std::chrono::milliseconds(100);

/// As far as both go: one may have been read where the longer one was refused.
bool are_equal(RegisterView one, RegisterView other) {
  const std::size_t size = std::min(one.size(), other.size());
  const RegisterView begin = one.first(size);
  return std::equal(begin.begin(), begin.end(), other.begin());
}

}  // namespace

bool EventTracker::is_blank(RegisterView block) {
  return std::all_of(block.begin(), block.end(), [](std::uint16_t word) { return word == 0; });
}

bool EventTracker::may_be_counted_anew(std::uint16_t number) const {
  return unseen_ && number <= soon_reached + *unseen_ / fastest_event;
}

Tracked EventTracker::judge(std::uint16_t number, RegisterView block) const {
  if (!last_) return {Sequence::baseline};
  const std::uint32_t step = (number + numbers - *last_) % numbers;
  if (step == 0) {
    const bool other = last_block_ && !are_equal(*last_block_, block);
    return {other ? Sequence::restart : Sequence::repeat};
  }
  const bool wrapped = number < *last_;
  if (wrapped && (step > wrap_reach || is_blank(block))) return {Sequence::restart};
  if (may_be_counted_anew(number)) return {Sequence::doubtful};
  if (wrapped) return {Sequence::wrap, step - 1};
  return step == 1 ? Tracked{Sequence::next} : Tracked{Sequence::jump, step - 1};
}

Tracked EventTracker::track(std::uint16_t number, RegisterView block) {
  const bool known = std::any_of(recent_.begin(), recent_.end(), [&](const Registers& earlier) {
    return are_equal(earlier, block);
  });
  if (known) return {Sequence::repeat};
  const Tracked tracked = judge(number, block);
  unseen_.reset();
  last_ = number;
  last_block_.emplace(block.begin(), block.end());
  recent_.push_back(*last_block_);
  if (recent_.size() > remembered) recent_.pop_front();
  return tracked;
}

}  // namespace spindle::device
