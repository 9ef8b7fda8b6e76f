#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "spindle/base/clock.hpp"
#include "spindle/catalogue/curve.hpp"
#include "spindle/device/event_source.hpp"

namespace spindle::device {

/// Brings the parts of curves together with their events. A part that comes without an event
/// belongs to the event that came shortly before it, or comes shortly behind it, and counts as many
/// samples on that channel; one that fits none, or would fit two, is told as a curve of no event
/// rather than of the wrong one. Holds the parts of one result at most. No threads, no clock of its
/// own.
class CurveCollector {
 public:
  using Tell = std::function<void(const ToolCurve&)>;

  /// `frames` must outlive it.
  CurveCollector(const catalogue::EventFrames& frames, Tell tell)
      : frames_(&frames), tell_(std::move(tell)) {}

  /// An event was told, or seen again; `channels` came in the same frame. Parts that are still
  /// missing may follow.
  void take_event(std::uint16_t number, const Registers& key, const Registers& block,
                  std::vector<catalogue::ChannelSamples> channels, TimePoint now, WallTime wall);
  /// A part without its event.
  void take_part(catalogue::ChannelSamples part, TimePoint now, WallTime wall);

  /// Before an event that is new is told: what is still open of the one before is told as it is.
  void close_before(const Registers& key);
  /// When run_due() has something to tell; TimePoint::max(): nothing is open.
  [[nodiscard]] TimePoint next_due() const;
  /// Tells what has waited long enough.
  void run_due(TimePoint now);
  /// Tells all that is open: nothing comes any more.
  void flush();

 private:
  struct Open {
    std::uint16_t number = 0;
    Registers key = {};
    Registers block = {};
    std::vector<std::size_t> counts = {};
    std::vector<Bytes> channels = {};
    TimePoint until = {};
    WallTime time = {};
  };
  struct Part {
    catalogue::ChannelSamples part = {};
    TimePoint until = {};
    WallTime time = {};
  };

  bool fits(const Open& open, const catalogue::ChannelSamples& part) const;
  void put(Open& open, catalogue::ChannelSamples part, TimePoint now, WallTime wall);
  void close_if_whole();
  void close();
  void tell_stray(Part part);

  const catalogue::EventFrames* frames_;
  Tell tell_;
  std::optional<Open> open_ = std::nullopt;  ///< the event whose curves are awaited
  std::deque<Part> early_ = {};              ///< parts that came before their event
  std::deque<Registers> told_ = {};          ///< keys of events whose curves were told
  /// Whether the tool was seen to send the parts in front of their event: then none is taken for
  /// the event before.
  bool parts_lead_ = false;
};

}  // namespace spindle::device
