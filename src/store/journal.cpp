#include "store/journal.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <limits>

#include "store/columns.hpp"

namespace spindle::store {
namespace {

constexpr int event_columns = 12;  ///< of an event beside those of Columns

std::string places(int count) {
  std::string text = "?1";
  for (int place = 2; place <= count; ++place) text += fmt::format(", ?{}", place);
  return text;
}

std::string event_insertion() {
  return fmt::format(
      "INSERT INTO event (tool, epoch, number, place, at, tool_time, source, kind, remembered, "
      "barcode, raw, {}) VALUES ({})",
      names_of(column_words), places(event_columns - 1 + static_cast<int>(column_count)));
}

std::string settings_insertion() {
  return fmt::format("INSERT INTO preset (tool, preset, since, {}) VALUES ({})",
                     names_of(setting_words), places(3 + static_cast<int>(setting_count)));
}

std::string settings_query() {
  return fmt::format(
      "SELECT since, {} FROM preset WHERE tool = ?1 AND preset = ?2 ORDER BY since DESC LIMIT 1",
      names_of(setting_words));
}

Bytes bytes_of(RegisterView registers) {
  Bytes bytes;
  bytes.reserve(2 * registers.size());
  for (const std::uint16_t value : registers) put_u16(bytes, value);
  return bytes;
}

/// Empty texts are not known ones.
std::optional<std::string_view> known(const std::string& text) {
  if (text.empty()) return std::nullopt;
  return text;
}

bool is_same(const Rows& row, const Place& place) {
  return row.text(1) == place.name && row.text(2) == place.url && row.text(3) == place.profile &&
         row.maybe(4) == place.firmware && row.text(5) == place.torque_unit &&
         row.maybe(6) == place.fence;
}

Gap conflict_gap(const NewEvent& entry, WallTime other) {
  Gap gap;
  gap.before = entry.event.number;
  gap.began = entry.gap ? entry.gap->began : other;
  gap.ended = entry.event.at;
  gap.reason = fmt::format(
      "another event with number {} was stored before: the tool may have begun to count anew, or "
      "another tool has its serial number",
      entry.event.number);
  return gap;
}

}  // namespace

Journal::Journal(Connection& connection)
    : connection_(connection),
      last_(connection),
      find_tool_(connection, "SELECT id FROM tool WHERE maker = ?1 AND serial = ?2"),
      insert_tool_(connection, "INSERT INTO tool (maker, serial, model) VALUES (?1, ?2, ?3)"),
      newest_place_(connection,
                    "SELECT id, name, url, profile, firmware, torque_unit, fence FROM place "
                    "WHERE tool = ?1 ORDER BY id DESC LIMIT 1"),
      insert_place_(connection,
                    "INSERT INTO place (tool, name, url, profile, firmware, torque_unit, since, "
                    "fence) VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8)"),
      set_seen_(
          connection,
          "UPDATE place SET seen = ?2 WHERE id = (SELECT max(id) FROM place WHERE tool = ?1)"),
      insert_epoch_(connection,
                    "INSERT INTO epoch (tool, ordinal, began, reason) VALUES (?1, ?2, ?3, ?4)"),
      find_event_(connection,
                  "SELECT id, at, raw FROM event WHERE tool = ?1 AND epoch = ?2 AND number = ?3"),
      insert_event_(connection, event_insertion()),
      find_gap_(connection,
                "SELECT id FROM gap WHERE tool = ?1 AND epoch = ?2 AND before IS ?3 "
                "AND after IS ?4 AND reason = ?5 AND (before IS NOT NULL OR after IS NOT NULL "
                "OR began = ?6)"),
      insert_gap_(connection,
                  "INSERT INTO gap (tool, epoch, after, before, missed, at_least, began, ended, "
                  "reason) VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9)"),
      newest_settings_(connection, settings_query()),
      insert_settings_(connection, settings_insertion()),
      find_happening_(connection,
                      "SELECT id FROM happening WHERE at = ?1 AND tool IS ?2 AND type = ?3 "
                      "AND json = ?4"),
      insert_happening_(connection,
                        "INSERT INTO happening (at, tool, type, json) VALUES (?1, ?2, ?3, ?4)"),
      insert_curve_(connection,
                    "INSERT INTO curve (event, interval_us, channels, samples) "
                    "SELECT id, ?4, ?5, ?6 FROM event WHERE tool = ?1 AND epoch = ?2 AND "
                    "number = ?3 ON CONFLICT DO NOTHING") {}

std::optional<RowId> Journal::find_tool(const ToolName& name) {
  Rows rows = find_tool_.query(name.maker, name.serial);
  if (!rows.next()) return std::nullopt;
  return rows.integer(0);
}

RowId Journal::tool(const ToolName& name, const std::string& model) {
  if (const auto id = find_tool(name)) return *id;
  insert_tool_.run(name.maker, name.serial, known(model));
  return new_row();
}

bool Journal::has_tool(const ToolName& name) { return find_tool(name).has_value(); }

RowId Journal::place(const Place& place) {
  {
    Rows rows = newest_place_.query(place.tool);
    if (rows.next() && is_same(rows, place)) return rows.integer(0);
  }
  insert_place_.run(place.tool, place.name, place.url, place.profile, place.firmware,
                    known(place.torque_unit), place.since, place.fence);
  return new_row();
}

void Journal::adopt(RowId tool, const Last& other) {
  const auto epoch = last_.newest_epoch(tool);
  const auto last = last_.find(tool);
  const bool is_ahead = epoch && (*epoch > other.epoch ||
                                  (*epoch == other.epoch && last && last->number >= other.number));
  if (is_ahead) return;
  // Why the other collector began each of them is in its own store.
  for (std::int64_t next = epoch ? *epoch + 1 : 0; next <= other.epoch; ++next) {
    begin_epoch(tool, next, other.seen, next == 0 ? EpochReason::first : EpochReason::restart);
  }
  // Behind the highest number there is none that a gap could end before.
  if (other.number == std::numeric_limits<std::uint16_t>::max()) return;
  Gap gap{.before = static_cast<std::uint16_t>(other.number + 1),
          .began = last ? last->seen : other.seen,
          .ended = other.seen,
          .reason = std::string(recorded_elsewhere)};
  if (last && last->epoch == other.epoch) {
    gap.after = last->number;
    gap.missed = static_cast<std::uint32_t>(other.number - last->number);
  }
  store(gap, tool, other.epoch);
}

void Journal::begin_epoch(RowId tool, std::int64_t ordinal, WallTime at, EpochReason reason) {
  insert_epoch_.run(tool, ordinal, at, epoch_reason_words.text(reason));
}

std::optional<Journal::Taken> Journal::taken(const Event& event, std::int64_t epoch,
                                             const Bytes& raw) {
  Rows rows = find_event_.query(event.tool, epoch, event.number);
  if (!rows.next()) return std::nullopt;
  return Taken{.id = rows.integer(0),
               .at = rows.time(1),
               .is_equal = std::ranges::equal(rows.bytes(2), raw)};
}

Stored Journal::store(const NewEvent& entry) {
  const Event& event = entry.event;
  const Bytes raw = bytes_of(event.raw);
  const auto newest = last_.newest_epoch(event.tool);
  std::int64_t epoch = newest.value_or(0);
  if (!newest) {
    begin_epoch(event.tool, epoch, event.at, EpochReason::first);
  } else {
    const auto other = taken(event, epoch, raw);
    // The entry that began this epoch, handed over once more, begins no other one.
    const bool is_repeated = other && other->is_equal && (!entry.begins || other->at == event.at);
    if (is_repeated) return {.as = Stored::As::known, .id = other->id, .epoch = epoch};
    if (entry.begins) {
      begin_epoch(event.tool, ++epoch, event.at, *entry.begins);
    } else if (other) {
      return insert_conflict(entry, epoch + 1, *other, raw);
    }
  }
  Stored stored = {.as = Stored::As::row, .id = insert(event, epoch, raw), .epoch = epoch};
  if (entry.gap) stored.gap = store(*entry.gap, event.tool, epoch).id;
  return stored;
}

RowId Journal::insert(const Event& event, std::int64_t epoch, const Bytes& raw) {
  int place = event_columns;
  for (const auto& [word, column] : column_words)
    insert_event_.bind(place++, event.columns[column]);
  insert_event_.run(event.tool, epoch, event.number, event.place, event.at, event.tool_time,
                    event.source, event.kind, event.remembered, known(event.barcode),
                    ByteView(raw));
  return new_row();
}

Stored Journal::insert_conflict(const NewEvent& entry, std::int64_t epoch, const Taken& other,
                                const Bytes& raw) {
  const Event& event = entry.event;
  begin_epoch(event.tool, epoch, event.at, EpochReason::unsure);
  const RowId row = insert(event, epoch, raw);
  const RowId gap = store(conflict_gap(entry, other.at), event.tool, epoch).id;
  return {.as = Stored::As::conflict, .id = row, .epoch = epoch, .gap = gap};
}

Stored Journal::store(const Gap& gap, RowId tool, std::int64_t epoch) {
  {
    Rows rows = find_gap_.query(tool, epoch, gap.before, gap.after, gap.reason, gap.began);
    if (rows.next()) return {.as = Stored::As::known, .id = rows.integer(0), .epoch = epoch};
  }
  insert_gap_.run(tool, epoch, gap.after, gap.before, gap.missed, gap.at_least, gap.began,
                  gap.ended, gap.reason);
  return {.as = Stored::As::row, .id = new_row(), .epoch = epoch};
}

Stored Journal::store(const NewGap& entry) {
  const Gap& gap = entry.gap;
  const auto newest = last_.newest_epoch(gap.tool);
  if (!newest) begin_epoch(gap.tool, 0, gap.began, EpochReason::first);
  return store(gap, gap.tool, newest.value_or(0));
}

Stored Journal::store(const PresetSettings& settings) {
  WallTime since = settings.since;
  {
    Rows newest = newest_settings_.query(settings.tool, settings.preset);
    if (newest.next()) {
      bool is_same = true;
      int column = 1;
      for (const auto& [word, setting] : setting_words) {
        is_same = is_same && newest.maybe(column++) == settings[setting];
      }
      if (is_same) return {.as = Stored::As::merged};
      // A clock that was set back changes no order.
      since = std::max(since, newest.time(0) + std::chrono::milliseconds(1));
    }
  }
  int place = 4;
  for (const auto& [word, setting] : setting_words) {
    insert_settings_.bind(place++, settings[setting]);
  }
  insert_settings_.run(settings.tool, settings.preset, since);
  return {.as = Stored::As::row};
}

Stored Journal::store(const Happening& happening) {
  {
    Rows rows = find_happening_.query(happening.at, happening.tool, happening.type, happening.json);
    if (rows.next()) return {.as = Stored::As::known, .id = rows.integer(0)};
  }
  insert_happening_.run(happening.at, happening.tool, happening.type, happening.json);
  return {.as = Stored::As::row, .id = new_row()};
}

Stored Journal::store(const NewCurve& entry) {
  const auto epoch = last_.newest_epoch(entry.tool);
  if (!epoch) return {.as = Stored::As::known};
  const Curve& curve = entry.curve;
  insert_curve_.run(entry.tool, *epoch, entry.number, curve.interval_us,
                    std::string_view(curve.channels), ByteView(curve.samples));
  const bool is_new = !connection_.failed() && sqlite3_changes(connection_.handle()) > 0;
  return {.as = is_new ? Stored::As::row : Stored::As::known,
          .id = is_new ? new_row() : 0,
          .epoch = *epoch};
}

Stored Journal::store(const Seen& seen) {
  set_seen_.run(seen.tool, seen.at);
  return {.as = Stored::As::merged};
}

}  // namespace spindle::store
