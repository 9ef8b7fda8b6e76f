#include "stored_records.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "records.hpp"
#include "spindle/work/event_rows.hpp"

namespace spindle::commands {
namespace {

using report::Align;
using report::Audience;
using report::Column;
using report::Field;
using report::Record;
using report::Tone;
using store::RowId;

Field only_shown(std::string key, std::string text, Tone tone = Tone::plain) {
  return {.key = std::move(key),
          .cell = text_or_null(std::move(text)),
          .audience = Audience::columns,
          .tone = tone};
}

template <typename Row>
const Row* find_row(const std::map<RowId, const Row*>& rows, RowId id) {
  const auto found = rows.find(id);
  return found == rows.end() ? nullptr : found->second;
}

/// "lost: closed by the tool", or else the facts one behind the other.
std::string text_of(const Record& record) {
  const Field* state = record.find("state");
  const Field* message = record.find("message");
  if (state != nullptr && message != nullptr) {
    return fmt::format("{}: {}", report::to_text(state->cell), report::to_text(message->cell));
  }
  std::string text;
  for (const Field& field : record.fields) {
    const std::string value = report::to_text(field.cell);
    if (value.empty() || field.key == "serial" || field.key == "raw") continue;
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", field.key, value);
  }
  return text;
}

}  // namespace

Decimal in_units(std::int64_t steps) {
  int exponent = -4;
  for (; exponent < -2 && steps % 10 == 0; ++exponent) steps /= 10;
  return {steps, exponent};
}

Result<StoredRecords> StoredRecords::make(store::Reader& reader, ProfileShelf& shelf,
                                          Context& context) {
  StoredRecords records(shelf, context);
  const auto read = records.refresh(reader);
  if (!read) return tl::unexpected(read.error());
  return records;
}

Result<std::vector<const store::Place*>> StoredRecords::refresh(store::Reader& reader) {
  TRY_LET(auto places, reader.places());
  std::vector<const store::Place*> fresh;
  for (store::Place& place : places) {
    if (place_by_id_.contains(place.id)) continue;
    places_.push_back(std::move(place));
    fresh.push_back(&places_.back());
    place_by_id_[places_.back().id] = &places_.back();
  }
  if (fresh.empty()) return fresh;
  TRY_LET(auto tools, reader.tools());
  for (store::Tool& tool : tools) {
    if (tool_by_id_.contains(tool.id)) continue;
    tools_.push_back(std::move(tool));
    tool_by_id_[tools_.back().id] = &tools_.back();
  }
  return fresh;
}

const store::Tool* StoredRecords::tool(RowId id) const { return find_row(tool_by_id_, id); }
const store::Place* StoredRecords::place(RowId id) const { return find_row(place_by_id_, id); }

const store::Place* StoredRecords::place_at(RowId tool, WallTime time) const {
  const store::Place* found = nullptr;
  for (const store::Place& place : places_) {
    if (place.tool == tool && (found == nullptr || place.since <= time)) found = &place;
  }
  return found;
}

StoredRecords::Speaker& StoredRecords::speaker(const store::Place& place) {
  auto& speaker = speakers_[place.id];
  if (speaker) return *speaker;
  speaker = std::make_unique<Speaker>();
  speaker->target.shown = place.name;
  speaker->target.torque_unit = place.torque_unit;
  const auto known = shelf_->take(place.profile);
  if (known && (*known)->profile.events) {
    speaker->known = *known;
  }
  speaker->is_strange = !known;
  if (!known && told_.insert(place.profile).second) {
    context_->renderer.note(
        fmt::format("the profile of {} cannot be used ({}): of its events there is what the store "
                    "itself understands",
                    place.name, describe(known.error())));
  }
  const KnownProfile* words = speaker->known != nullptr ? speaker->known : shelf_->nameless();
  speaker->records.emplace(speaker->target, words->profile, words->tables);
  return *speaker;
}

const KnownProfile* StoredRecords::known(const store::Place& place) { return speaker(place).known; }

Naming StoredRecords::naming(RowId tool, std::int64_t epoch, RowId id) const {
  const store::Tool* row = this->tool(tool);
  return {.serial = row == nullptr ? std::string() : row->name.serial, .epoch = epoch, .id = id};
}

Record StoredRecords::event(const store::EventView& row) {
  const store::Place* place = this->place(row.place);
  const Speaker& speaker = this->speaker(place != nullptr ? *place : store::Place());
  const bool fits = speaker.known != nullptr && row.raw.size() % 2 == 0 &&
                    speaker.known->profile.events->has_form(row.raw.size() / 2);
  Record record = fits ? speaker.records->event(news_of(row), naming(row.tool, row.epoch, row.id))
                       : event_by_columns(row, speaker);
  if (fits && context_->user.format == report::Format::csv) {
    speaker.records->add_units(record);
  }
  return record;
}

Record StoredRecords::event_by_columns(const store::EventView& row, const Speaker& speaker) const {
  const Naming name = naming(row.tool, row.epoch, row.id);
  Record record{.type = "event", .target = speaker.target.shown, .time = row.at, .fields = {}};
  record.fields = {{"serial", text_or_null(name.serial)},
                   {"epoch", number(row.epoch)},
                   {"id", number(row.id)},
                   {"kind", std::string(row.kind)},
                   {"source", std::string(row.source)},
                   {"number", number(row.number)}};
  for (const auto& [word, column] : store::column_words) {
    if (!row.columns[column]) continue;
    const std::int64_t value = *row.columns[column];
    record.fields.push_back(
        {std::string(word), is_torque(column) ? in_units(value) : Decimal(value)});
  }
  if (!row.barcode.empty()) record.fields.push_back({"barcode", std::string(row.barcode)});
  record.fields.push_back({"torque_unit", text_or_null(speaker.target.torque_unit)});
  record.fields.push_back({"raw", news_of(row).block});
  if (row.remembered) record.fields.push_back({"remembered", true});
  if (row.kind == "fastening-ok") record.fields.push_back(only_shown("result", "OK", Tone::good));
  if (row.kind == "fastening-ng") record.fields.push_back(only_shown("result", "NG", Tone::bad));
  const auto& error = row.columns[store::Column::error];
  if (error && *error != 0) record.fields.push_back(only_shown("text", fmt::format("E{}", *error)));
  return record;
}

Record StoredRecords::gap(const store::Gap& row) {
  const store::Place* place = place_at(row.tool, row.ended);
  const Speaker& speaker = this->speaker(place != nullptr ? *place : store::Place());
  Record record =
      speaker.records->gap(work::news_of(row), row.ended, naming(row.tool, row.epoch, row.id));
  return record;
}

Record StoredRecords::happening(const store::Happening& row) const {
  Record record =
      report::record_of(row.json, row.at)
          .value_or(Record{
              .type = row.type, .target = {}, .time = row.at, .fields = {{"json", row.json}}});
  const Field* state = record.find("state");
  const bool is_loss = state != nullptr && report::to_text(state->cell) == "lost";
  std::string text = text_of(record);
  if (record.find("kind") == nullptr) {
    record.fields.push_back(only_shown("kind", row.type, is_loss ? Tone::bad : Tone::plain));
  }
  record.fields.push_back(only_shown("text", std::move(text)));
  return record;
}

std::vector<Column> StoredRecords::table_columns(const std::vector<const store::Place*>& places,
                                                 Tools tools) {
  NewsSources sources{.tools = tools};
  bool is_any_strange = false;
  for (const store::Place* place : places) {
    const KnownProfile* known = this->known(*place);
    if (known != nullptr) sources.profiles.push_back(&known->profile);
    if (known != nullptr) sources.torque_units.push_back(place->torque_unit);
    is_any_strange = is_any_strange || speaker(*place).is_strange;
  }
  std::vector<Column> columns = news_columns(sources);
  if (is_any_strange) {
    const auto text = columns.back();
    columns.pop_back();
    const auto add = [&](store::Column column, std::string title, std::size_t width) {
      const std::string key(store::column_words.text(column));
      add_new(columns, {std::move(title), key, Align::right, width});
    };
    add(store::Column::preset, "PRESET NUMBER", 13);
    add(store::Column::torque, "TORQUE", 7);
    add(store::Column::a3, "TOTAL ANGLE", 11);
    columns.push_back(text);
  }
  return columns;
}

std::vector<Column> StoredRecords::all_columns(const std::vector<const store::Place*>& places) {
  std::vector<Column> columns;
  for (const char* key : {"type", "id", "time", "target", "serial", "epoch", "kind", "result",
                          "source", "remembered"}) {
    columns.push_back({key, key});
  }
  for (const store::Place* place : places) {
    const KnownProfile* known = this->known(*place);
    if (known != nullptr) {
      add_event_fields(columns, known->profile);
    } else if (speaker(*place).is_strange) {
      add_new(columns, {"number", "number"});
      for (const auto& [word, column] : store::column_words) {
        add_new(columns, {std::string(word), std::string(word)});
      }
      add_new(columns, {"barcode", "barcode"});
    }
  }
  for (const char* key : {"torque_unit", "missed", "after", "before", "reason", "text", "raw"}) {
    add_new(columns, {key, key});
  }
  return columns;
}

}  // namespace spindle::commands
