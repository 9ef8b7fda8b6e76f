#include "record_counters.hpp"

#include <algorithm>

namespace spindle::commands {

void RecordCounters::begin(const std::string& tool) { note_link(tool, false); }

void RecordCounters::leave(const std::string& tool) {
  const std::lock_guard lock(mutex_);
  metrics_.links.erase(tool);
}

void RecordCounters::note_link(const std::string& tool, bool is_up) {
  const std::lock_guard lock(mutex_);
  metrics_.links[tool] = is_up;
}

void RecordCounters::note_stored(const std::string& tool, const store::Event& event) {
  const std::lock_guard lock(mutex_);
  metrics_.count_event(tool, event.kind, event.columns[store::Column::preset], event.at);
}

void RecordCounters::note_stored(const std::string& tool, const store::Gap& gap) {
  const std::lock_guard lock(mutex_);
  metrics_.count_gap(tool, gap);
}

void RecordCounters::note_commit(Duration took) {
  const std::lock_guard lock(mutex_);
  metrics_.commits->add(took);
}

std::size_t RecordCounters::connected() const {
  const std::lock_guard lock(mutex_);
  return static_cast<std::size_t>(std::count_if(metrics_.links.begin(), metrics_.links.end(),
                                                [](const auto& link) { return link.second; }));
}

std::uint64_t RecordCounters::results() const {
  const std::lock_guard lock(mutex_);
  std::uint64_t sum = 0;
  for (const auto& [labels, count] : metrics_.results) sum += count;
  return sum;
}

Metrics RecordCounters::metrics() const {
  const std::lock_guard lock(mutex_);
  return metrics_;
}

Result<std::vector<store::Stored>> TimedWriter::commit(std::span<const store::Entry> entries) {
  const TimePoint began = clock_->now();
  auto stored = writer_->commit(entries);
  if (stored) counters_->note_commit(clock_->now() - began);
  return stored;
}

}  // namespace spindle::commands
