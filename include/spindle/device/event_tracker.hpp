#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <optional>
#include <string_view>
#include <utility>

#include "spindle/base/bytes.hpp"
#include "spindle/base/clock.hpp"

namespace spindle::device {

/// What the number of an event says about it.
enum class Sequence : std::uint8_t {
  baseline,  ///< the first number seen: an old event, not a result
  repeat,    ///< seen before
  next,      ///< one more than the last
  jump,      ///< more than one more: `missed` events were not seen
  wrap,      ///< the 16-bit counter began again behind 65535; `missed` may be 0
  restart,   ///< the tool began to count anew: smaller and not by wrapping, or another event with
             ///< the last number; what was missed is unknown
  doubtful,  ///< behind the last number, but the tool may have begun to count anew while no client
             ///< looked, and come to it: what was missed is unknown
};

struct Tracked {
  Sequence novelty = Sequence::baseline;
  std::uint32_t missed = 0;  ///< for `jump` and `wrap`

  /// Whether the event is a result that is new.
  [[nodiscard]] bool is_new() const {
    return novelty != Sequence::baseline && novelty != Sequence::repeat;
  }
};

/// Decides what is new: nothing lost silently, nothing told twice. Numbers are 16-bit counters that
/// go up by one per event, and may begin anew when the tool is switched off. A block that equals
/// one of the last few in every register is a repeat even when its number is not the last one.
/// Pure.
class EventTracker {
 public:
  /// `block` is the whole event block; `number` its counter.
  Tracked track(std::uint16_t number, RegisterView block);

  /// A number that was read without its block: the next event is judged against it.
  void set_baseline(std::uint16_t number) {
    last_ = number;
    last_block_.reset();
  }

  /// The last event that is known of a tool from before: its block, where it was seen.
  void set_last(std::uint16_t number, std::optional<Registers> block) {
    last_ = number;
    last_block_ = std::move(block);
  }

  /// The connection is a new one, and the tool was not looked at for so long. Nothing comes late on
  /// it, a tool that was restarted may have equal events, and the next number is doubtful when a
  /// tool that began to count anew in that time can have come to it.
  void look_again(Duration unseen) {
    recent_.clear();
    unseen_ = std::max(unseen_.value_or(Duration::zero()), unseen);
  }

  [[nodiscard]] std::optional<std::uint16_t> last() const { return last_; }

  /// The registers of a tool that has had no event since it was switched on.
  [[nodiscard]] static bool is_blank(RegisterView block);

 private:
  [[nodiscard]] Tracked judge(std::uint16_t number, RegisterView block) const;
  [[nodiscard]] bool may_be_counted_anew(std::uint16_t number) const;

  std::optional<std::uint16_t> last_ = std::nullopt;
  std::optional<Registers> last_block_ = std::nullopt;  ///< of the last number, where it was seen
  std::deque<Registers> recent_ = {};
  std::optional<Duration> unseen_ = std::nullopt;  ///< until the first event behind it
};

}  // namespace spindle::device
