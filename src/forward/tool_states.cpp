#include "tool_states.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <string_view>
#include <utility>

#include "spindle/catalogue/profile.hpp"
#include "spindle/forward/parcel.hpp"

namespace spindle::forward {
namespace {

using catalogue::EventKind;
using report::Record;
using store::RowId;

/// A recorder says every ten seconds which tools it listens to, and stores it within ten more.
constexpr Duration heard_limit = std::chrono::minutes(1);

std::vector<std::string> words(std::initializer_list<EventKind> kinds) {
  std::vector<std::string> list;
  for (const EventKind kind : kinds) list.emplace_back(to_text(kind));
  return list;
}

const std::array<std::string_view, 7> of_result = {"number",      "epoch", "preset",    "torque",
                                                   "torque_unit", "error", "error_text"};

report::Cell cell_of(const Record& record, std::string_view key) {
  const report::Field* field = record.find(key);
  return field == nullptr ? report::Cell() : field->cell;
}

}  // namespace

Result<std::vector<ToolState>> ToolStates::changed(WallTime now) {
  TRY_LET(const auto state, rows_->reader().state());
  if (state != std::exchange(state_, state)) {
    TRY_LET(const auto ends, rows_->reader().ends());
    TRY(rows_->refresh());
    TRY(read_places());
    TRY(read_new_events());
    TRY(read_happenings());
    read_ = ends;
    is_begun_ = true;
  }
  std::vector<ToolState> states;
  for (const auto& [target, tool] : tool_of_) {
    Record record = record_of(subjects_.at(tool), now);
    record.time = {};
    std::string& told = told_[target];
    if (std::string json = report::to_json(record); json != told) {
      told = std::move(json);
      record.time = now;
      states.push_back({.target = target, .json = report::to_json(record)});
    }
  }
  return states;
}

std::vector<std::string> ToolStates::targets() const {
  std::vector<std::string> names;
  for (const auto& [target, tool] : tool_of_) names.push_back(target);
  return names;
}

/// The newest place of a tool counts, and of a target the newest of those.
Result<void> ToolStates::read_places() {
  TRY_LET(const auto places, rows_->reader().places());
  std::map<RowId, const store::Place*> newest;
  for (const store::Place& place : places) newest[place.tool] = &place;
  tool_of_.clear();
  std::map<std::string, RowId> place_of;
  for (const auto& [tool, place] : newest) {
    const bool is_new = !subjects_.contains(tool);
    Subject& subject = subjects_[tool];
    subject.place = *place;
    subject.heard = std::max(subject.heard, place->seen.value_or(place->since));
    const store::Tool* row = rows_->tool(tool);
    if (row != nullptr) subject.serial = row->name.serial;
    if (is_new) {
      TRY(read_all(subject));
    }
    RowId& best = place_of[place->name];
    if (place->id <= best) continue;
    best = place->id;
    tool_of_[place->name] = tool;
  }
  return {};
}

/// Of a tool that was not known here: what it told last.
Result<void> ToolStates::read_all(Subject& subject) {
  const RowId tool = subject.place.tool;
  constexpr store::Counted end = {.epoch = std::numeric_limits<std::int64_t>::max(),
                                  .number = std::numeric_limits<std::uint16_t>::max()};
  for (const auto& kinds : {words({EventKind::fastening_ok, EventKind::fastening_ng}),
                            words({EventKind::error, EventKind::alarm_reset})}) {
    TRY_LET(const auto last, rows_->reader().counted_before(tool, end, kinds));
    if (!last) continue;
    TRY(read_event(tool, *last));
  }
  return {};
}

Result<void> ToolStates::read_event(RowId tool, const store::Counted& counted) {
  return rows_->reader().events({.tools = {tool}, .epoch = counted.epoch, .number = counted.number},
                                [&](const store::EventView& row) {
                                  take(row);
                                  return true;
                                });
}

/// Of each tool only what it told last is looked at closely.
Result<void> ToolStates::read_new_events() {
  if (!is_begun_) return {};
  std::map<std::pair<RowId, bool>, store::Counted> last;
  const auto kinds = words(
      {EventKind::fastening_ok, EventKind::fastening_ng, EventKind::error, EventKind::alarm_reset});
  TRY(rows_->reader().events(
      {.kinds = kinds, .after = read_.event, .columns = std::vector<store::Column>()},
      [&](const store::EventView& row) {
        const bool is_alarm =
            row.kind == to_text(EventKind::error) || row.kind == to_text(EventKind::alarm_reset);
        last[{row.tool, is_alarm}] = {.epoch = row.epoch, .number = row.number};
        return true;
      }));
  for (const auto& [key, counted] : last) {
    TRY(read_event(key.first, counted));
  }
  return {};
}

void ToolStates::take(const store::EventView& row) {
  const auto found = subjects_.find(row.tool);
  if (found == subjects_.end() || rows_->place(row.place) == nullptr) return;
  Subject& subject = found->second;
  subject.heard = std::max(subject.heard, row.at);
  if (row.kind == to_text(EventKind::error)) {
    const Record record = rows_->event(row);
    subject.alarm = cell_of(record, "error");
    subject.alarm_text = cell_of(record, "error_text");
  } else if (row.kind == to_text(EventKind::alarm_reset)) {
    subject.alarm = {};
    subject.alarm_text = {};
  } else {
    subject.seq = sequence_number(row.epoch, row.number);
    subject.result = rows_->event(row);
    subject.result->fields.push_back(
        {"passed", row.kind == to_text(EventKind::fastening_ok) ? "OK" : "NG"});
  }
}

Result<void> ToolStates::read_happenings() {
  return rows_->reader().happenings({.kinds = {"link", "event"}, .after = read_.happening},
                                    [&](const store::Happening& row) {
                                      take(row);
                                      return true;
                                    });
}

void ToolStates::take(const store::Happening& row) {
  const auto found = row.tool ? subjects_.find(*row.tool) : subjects_.end();
  if (found == subjects_.end()) return;
  Subject& subject = found->second;
  subject.heard = std::max(subject.heard, row.at);
  const auto record = report::record_of(row.json, row.at);
  if (!record) return;
  if (row.type == "link") {
    subject.link = report::to_text(cell_of(*record, "state"));
    return;
  }
  // A motor says with each event which alarm it has; 0 is none.
  const bool is_alarm = report::to_text(cell_of(*record, "alarm")) != "0";
  subject.alarm = is_alarm ? cell_of(*record, "alarm") : report::Cell();
  subject.alarm_text = is_alarm ? cell_of(*record, "alarm_text") : report::Cell();
}

Record ToolStates::record_of(const Subject& subject, WallTime now) const {
  Record record = {.type = "state", .target = subject.place.name, .time = now, .fields = {}};
  const bool is_known = !subject.link.empty() && now - subject.heard < heard_limit;
  record.fields = {{"link", is_known ? subject.link : "unknown"},
                   {"serial", report::text_or_null(subject.serial)}};
  record.fields.push_back({"firmware", subject.place.firmware
                                           ? report::number(*subject.place.firmware)
                                           : report::Cell()});
  record.fields.push_back({"alarm", subject.alarm});
  record.fields.push_back({"alarm_text", subject.alarm_text});
  if (!subject.result) return record;
  for (const std::string_view key : of_result) {
    record.fields.push_back({std::string(key), cell_of(*subject.result, key)});
  }
  record.fields.push_back({"seq", report::number(subject.seq)});
  record.fields.push_back({"result", cell_of(*subject.result, "passed")});
  record.fields.push_back({"at", report::to_text(subject.result->time)});
  return record;
}

}  // namespace spindle::forward
