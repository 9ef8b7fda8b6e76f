#include "page/board.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "page/words.hpp"
#include "spindle/report/record.hpp"

namespace spindle::page {
namespace {

using store::Column;

/// So much is remembered to be said; what is older was said too late anyhow.
constexpr std::size_t most_said = 8;

std::string text_of(const report::Record& record, std::string_view key) {
  const report::Field* field = record.find(key);
  return field == nullptr ? std::string() : report::to_text(field->cell);
}

std::int64_t number_of(const report::Record& record, std::string_view key) {
  const report::Field* field = record.find(key);
  const auto* number = field == nullptr ? nullptr : std::get_if<Decimal>(&field->cell);
  return number == nullptr ? 0 : number->mantissa();
}

Trouble trouble(std::string what, std::int64_t code, const catalogue::CodeTexts& texts,
                WallTime at) {
  Trouble found{.what = std::move(what), .at = at};
  if (const catalogue::CodeText* known = texts.find(code)) {
    found.text = known->text.to_string();
    found.remedy = known->remedy.to_string();
  }
  return found;
}

bool is_fastening(std::string_view kind) {
  return kind == "fastening-ok" || kind == "fastening-ng";
}

bool is_loosening(const store::EventView& row, const ProductWords& words) {
  return words.loosening && row.columns[Column::direction] == words.loosening;
}

}  // namespace

MissedSum sum_of(const std::vector<Miss>& misses) {
  MissedSum sum;
  for (const Miss& miss : misses) {
    sum.count += miss.count.value_or(0);
    sum.at_least = sum.at_least || miss.at_least;
    sum.is_unsure = sum.is_unsure || !miss.count;
  }
  return sum;
}

Station& Board::touch(const std::string& name) {
  changed_.insert(name);
  Station& station = stations_[name];
  station.name = name;
  return station;
}

void Board::say(const Station& station, const std::string& words, WallTime at) {
  if (at < shift_.begin) return;
  said_.push_back(fmt::format("{}: {}", station.name, words));
  if (said_.size() > most_said) said_.erase(said_.begin());
}

void Board::note(const store::Place& place, const store::Tool* tool) {
  const auto known = stations_.find(place.name);
  const auto heard = std::max(place.seen.value_or(place.since), place.since);
  if (known != stations_.end() && known->second.place == place.id) {
    // Being heard again is no change of what is shown, as long as it is fresh.
    known->second.heard = std::max(known->second.heard.value_or(heard), heard);
    return;
  }
  if (known != stations_.end() && known->second.place > place.id) return;
  Station& station = touch(place.name);
  const bool is_other = station.tool != 0 && station.tool != place.tool;
  if (is_other) {
    // Another tool has come; what its predecessor did in this shift was done at this station.
    station.preset = station.target_torque = std::nullopt;
    station.last = std::nullopt;
    station.motor = std::nullopt;
    station.alarm = station.warning = std::nullopt;
    station.recent.clear();
    station.heard = std::nullopt;
  }
  station.place = place.id;
  station.tool = place.tool;
  station.profile = place.profile;
  station.unit = place.torque_unit;
  station.heard = std::max(station.heard.value_or(heard), heard);
  if (tool != nullptr) {
    station.maker = tool->name.maker;
    station.serial = tool->name.serial;
    station.model = tool->model;
  }
  name_of_tool_[place.tool] = place.name;
}

void Board::note(const store::EventView& row, const store::Place& place) {
  Station& station = touch(place.name);
  if (station.tool != 0 && station.tool != row.tool) {
    // A row of the tool that was here before: it counts for the shift, and no more.
    Station former{.name = place.name, .unit = place.torque_unit};
    note_fastening(row, former, words_(place.profile));
    station.ok += former.ok;
    station.ng += former.ng;
    return;
  }
  if (!row.remembered) station.heard = std::max(station.heard.value_or(row.at), row.at);
  const ProductWords& words = words_(place.profile);
  const auto& preset = row.columns[Column::preset];
  if (preset && preset != station.preset) {
    station.preset = preset;
    station.target_torque = std::nullopt;
    station.recent.clear();
  }
  if (is_fastening(row.kind)) return note_fastening(row, station, words);
  const auto error = row.columns[Column::error].value_or(0);
  if (row.kind == "error" && error != 0) {
    station.alarm = trouble(fmt::format("Error E{}", error), error, words.codes.error, row.at);
    say(station, station.alarm->what + " " + station.alarm->text, row.at);
  }
  if (row.kind == "alarm-reset") station.alarm = std::nullopt;
}

void Board::note_fastening(const store::EventView& row, Station& station,
                           const ProductWords& words) {
  if (is_loosening(row, words)) return;
  Fastening result{.at = row.at,
                   .is_ok = row.kind == "fastening-ok",
                   .is_old = row.remembered,
                   .number = row.number,
                   .torque = row.columns[Column::torque],
                   .error = row.columns[Column::error].value_or(0),
                   .barcode = std::string(row.barcode)};
  if (result.error != 0) {
    Trouble known = trouble({}, result.error, words.codes.error, row.at);
    result.text = std::move(known.text);
    result.remedy = std::move(known.remedy);
  }
  if (row.columns[Column::target_torque]) {
    station.target_torque = row.columns[Column::target_torque];
  }
  // A tool that fastens is not held by an error any more.
  if (!result.is_old) station.alarm = std::nullopt;
  if (!result.is_old && row.at >= shift_.begin) {
    ++(result.is_ok ? station.ok : station.ng);
    totals_.count_event(station.name, row.kind, row.columns[Column::preset], row.at);
  }
  if (!result.is_ok && !result.is_old) say(station, spoken(result, station.unit), row.at);
  station.recent.push_back(result);
  if (station.recent.size() > most_recent) station.recent.pop_front();
  station.last = std::move(result);
}

void Board::note(const store::Gap& row, const store::Place& place) {
  if (row.ended < shift_.begin) return;
  Station& station = touch(place.name);
  station.misses.push_back(
      {.at = row.ended, .count = row.missed, .at_least = row.at_least, .reason = row.reason});
  totals_.count_gap(station.name, row);
  say(station, missed_words(sum_of({station.misses.back()})), row.ended);
}

void Board::note(const store::Happening& row, const store::Place* place) {
  if (row.type == "link") note_link(row, place);
  if (row.type == "event") note_motor(row, place);
}

void Board::note_link(const store::Happening& row, const store::Place* place) {
  const auto record = report::record_of(row.json, row.at);
  if (!record) return;
  const std::string& name = place != nullptr ? place->name : record->target;
  if (name.empty()) return;
  Station& station = touch(name);
  LinkNews news{
      .state = text_of(*record, "state"), .message = text_of(*record, "message"), .at = row.at};
  const bool was_down = station.link && station.link->down_since;
  if (news.state != "connected") {
    news.down_since = was_down ? station.link->down_since : row.at;
  } else {
    station.heard = std::max(station.heard.value_or(row.at), row.at);
  }
  const bool is_down = news.down_since.has_value();
  if (is_down != was_down) say(station, is_down ? "no link" : "connected", row.at);
  station.link = std::move(news);
}

void Board::note_motor(const store::Happening& row, const store::Place* place) {
  const auto record = report::record_of(row.json, row.at);
  if (!record || record->find("alarm") == nullptr) return;
  const std::string& name = place != nullptr ? place->name : record->target;
  if (name.empty()) return;
  Station& station = touch(name);
  station.heard = std::max(station.heard.value_or(row.at), row.at);
  const std::string kind = text_of(*record, "kind");
  const bool is_trouble = kind == "alarm" || kind == "warning";
  // That there is an alarm says nothing of whether it turns.
  if (is_trouble && !station.motor) station.motor = MotorNews{.at = row.at};
  if (!is_trouble) {
    station.motor = MotorNews{.kind = kind, .at = row.at};
    if (const report::Field* speed = record->find("speed")) {
      if (const auto* number = std::get_if<Decimal>(&speed->cell)) station.motor->speed = *number;
    }
  }
  const ProductWords& words = words_(station.profile);
  const auto note = [&](std::string_view key, std::string_view word,
                        const catalogue::CodeTexts& texts, std::optional<Trouble>& kept) {
    const std::int64_t code = number_of(*record, key);
    const std::string what = fmt::format("{} {:02X}h", word, code);
    if (code == 0) {
      kept = std::nullopt;
    } else if (!kept || kept->what != what) {
      kept = trouble(what, code, texts, row.at);
      if (kept->text.empty()) kept->text = text_of(*record, std::string(key) + "_text");
      say(station, kept->what + " " + kept->text, row.at);
    }
  };
  note("alarm", "Alarm", words.codes.error, station.alarm);
  note("warning", "Warning", words.codes.warning, station.warning);
}

void Board::begin(Shift shift) {
  shift_ = shift;
  for (auto& [name, station] : stations_) {
    station.ok = station.ng = 0;
    station.misses.clear();
    changed_.insert(name);
  }
}

}  // namespace spindle::page
