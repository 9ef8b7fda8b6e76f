#include "spindle/device/curve_collector.hpp"

#include <algorithm>
#include <utility>

namespace spindle::device {
namespace {

/// How far apart the parts of one result may come. A tool that sends 8 kB over a weak wireless link
/// needs some tenths of a second; two results are hardly nearer to each other.
constexpr Duration together = std::chrono::seconds(2);

/// So many results are known to have been told, as many as an EventTracker knows repeats of.
constexpr std::size_t most_told = 16;

constexpr std::size_t sample_size = 4;

}  // namespace

void CurveCollector::take_event(std::uint16_t number, const Registers& key, const Registers& block,
                                std::vector<catalogue::ChannelSamples> channels, TimePoint now,
                                WallTime wall) {
  if (std::find(told_.begin(), told_.end(), key) != told_.end()) return;
  if (open_ && open_->key != key) close();
  if (!open_) {
    open_ = Open{.number = number,
                 .key = key,
                 .block = block,
                 .counts = frames_->counts_of(block),
                 .until = now + together,
                 .time = wall};
    open_->channels.resize(open_->counts.size());
  }
  // A frame with samples is the one that says how many there are.
  if (!channels.empty()) {
    open_->block = block;
    open_->counts = frames_->counts_of(block);
  }
  for (auto& part : channels) put(*open_, std::move(part), now, wall);
  for (auto waiting = early_.begin(); waiting != early_.end();) {
    if (open_ && fits(*open_, waiting->part)) {
      put(*open_, std::move(waiting->part), now, waiting->time);
      parts_lead_ = true;
      waiting = early_.erase(waiting);
    } else {
      ++waiting;
    }
  }
  close_if_whole();
}

void CurveCollector::take_part(catalogue::ChannelSamples part, TimePoint now, WallTime wall) {
  const bool has_begun = open_ && std::any_of(open_->channels.begin(), open_->channels.end(),
                                              [](const Bytes& one) { return !one.empty(); });
  if (open_ && fits(*open_, part) && (has_begun || !parts_lead_)) {
    put(*open_, std::move(part), now, wall);
    close_if_whole();
    return;
  }
  // A second part of the same channel shows that the first one's event never came.
  for (auto waiting = early_.begin(); waiting != early_.end();) {
    if (waiting->part.channel == part.channel) {
      tell_stray(std::move(*waiting));
      waiting = early_.erase(waiting);
    } else {
      ++waiting;
    }
  }
  early_.push_back({.part = std::move(part), .until = now + together, .time = wall});
}

bool CurveCollector::fits(const Open& open, const catalogue::ChannelSamples& part) const {
  return part.channel < open.counts.size() && open.channels[part.channel].empty() &&
         !part.samples.empty() && part.samples.size() == sample_size * open.counts[part.channel];
}

void CurveCollector::put(Open& open, catalogue::ChannelSamples part, TimePoint now, WallTime wall) {
  if (part.channel >= open.channels.size()) return;
  open.channels[part.channel] = std::move(part.samples);
  open.until = now + together;
  open.time = wall;
}

void CurveCollector::close_if_whole() {
  if (!open_) return;
  bool any = false;
  for (std::size_t channel = 0; channel < open_->counts.size(); ++channel) {
    if (open_->channels[channel].size() != sample_size * open_->counts[channel]) return;
    any |= open_->counts[channel] > 0;
  }
  if (any) close();
}

/// An event whose curves never came has none to tell.
void CurveCollector::close() {
  Open open = std::move(*std::exchange(open_, std::nullopt));
  bool any = false;
  bool whole = true;
  for (std::size_t channel = 0; channel < open.counts.size(); ++channel) {
    any |= !open.channels[channel].empty();
    whole &= open.channels[channel].size() == sample_size * open.counts[channel];
  }
  if (!any) return;
  told_.push_back(open.key);
  if (told_.size() > most_told) told_.pop_front();
  tell_({.block = std::move(open.block),
         .number = open.number,
         .channels = std::move(open.channels),
         .time = open.time,
         .is_whole = whole});
}

void CurveCollector::tell_stray(Part part) {
  std::vector<Bytes> channels(part.part.channel + 1);
  channels[part.part.channel] = std::move(part.part.samples);
  tell_({.channels = std::move(channels), .time = part.time, .is_whole = false});
}

void CurveCollector::close_before(const Registers& key) {
  if (open_ && open_->key != key) close();
}

TimePoint CurveCollector::next_due() const {
  TimePoint due = open_ ? open_->until : TimePoint::max();
  for (const Part& waiting : early_) due = std::min(due, waiting.until);
  return due;
}

void CurveCollector::run_due(TimePoint now) {
  if (open_ && open_->until <= now) close();
  while (!early_.empty() && early_.front().until <= now) {
    Part part = std::move(early_.front());
    early_.pop_front();
    tell_stray(std::move(part));
  }
}

void CurveCollector::flush() {
  if (open_) close();
  while (!early_.empty()) {
    Part part = std::move(early_.front());
    early_.pop_front();
    tell_stray(std::move(part));
  }
}

}  // namespace spindle::device
