#include <algorithm>

#include "spindle/commands/metrics.hpp"
#include "spindle/report/record.hpp"

namespace spindle::commands {
namespace {

/// A recorder that listens to a tool says so every ten seconds, and stores that with what comes
/// next. One that was stopped says nothing of its links.
constexpr Duration seen_for = std::chrono::seconds(45);

}  // namespace

Result<std::vector<SinkMetrics>> sink_metrics(store::Reader& reader, WallTime now) {
  TRY_LET(const auto sinks, reader.sinks());
  std::vector<SinkMetrics> all;
  for (const store::SinkRow& sink : sinks) {
    TRY_LET(const auto backlog, reader.behind(sink.positions));
    SinkMetrics one = {.name = sink.name, .backlog = backlog.events};
    if (backlog.oldest) one.oldest = std::max(Duration(now - *backlog.oldest), Duration::zero());
    all.push_back(std::move(one));
  }
  return all;
}

Result<Metrics> StoredMetrics::read(store::Reader& reader, WallTime now) {
  TRY(read_names(reader));
  const store::Filter new_events = {.after = events_, .columns = {{store::Column::preset}}};
  TRY(reader.events(new_events, [this](const store::EventView& event) {
    events_ = event.id;
    metrics_.count_event(name_of(event.tool), event.kind, event.columns[store::Column::preset],
                         event.at);
    return true;
  }));
  TRY_LET(const auto gaps, reader.gaps({.after = gaps_}));
  for (const store::Gap& gap : gaps) {
    gaps_ = gap.id;
    metrics_.count_gap(name_of(gap.tool), gap);
  }
  TRY(read_links(reader, now));
  TRY_LET(metrics_.store_bytes, reader.bytes());
  TRY_LET(metrics_.sinks, sink_metrics(reader, now));
  return metrics_;
}

Result<void> StoredMetrics::read_names(store::Reader& reader) {
  TRY_LET(const auto places, reader.places());
  for (const store::Place& place : places) {
    names_[place.tool] = place.name;
    if (place.seen) seen_[place.tool] = *place.seen;
  }
  return {};
}

Result<void> StoredMetrics::read_links(store::Reader& reader, WallTime now) {
  const store::Filter new_links = {.kinds = {"link"}, .after = happenings_};
  TRY(reader.happenings(new_links, [this](const store::Happening& happening) {
    happenings_ = happening.id;
    const auto record = report::record_of(happening.json, happening.at);
    const report::Field* state = record ? record->find("state") : nullptr;
    if (!happening.tool || state == nullptr) return true;
    up_[*happening.tool] = report::to_text(state->cell) == "connected";
    seen_[*happening.tool] = std::max(seen_[*happening.tool], happening.at);
    return true;
  }));
  metrics_.links.clear();
  for (const auto& [tool, is_up] : up_) {
    const auto seen = seen_.find(tool);
    const bool is_current = seen != seen_.end() && now - seen->second <= seen_for;
    bool& link = metrics_.links[name_of(tool)];
    link = link || (is_up && is_current);  // another tool may be at its place now
  }
  return {};
}

std::string StoredMetrics::name_of(store::RowId tool) const {
  const auto known = names_.find(tool);
  return known == names_.end() ? std::string() : known->second;
}

}  // namespace spindle::commands
