#include "watch_board.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>

#include "spindle/base/text.hpp"

namespace spindle::commands {
namespace {

using report::Align;
using report::Column;
using report::Field;
using report::Record;
using report::Tone;

/// The unit of the torque in front of it, with which it stays.
constexpr std::string_view unit_key = "torque_unit";

/// Columns of the stream that say nothing of a result.
constexpr std::array<std::string_view, 5> not_of_result = {"time", "target", "kind", "source",
                                                           "text"};

bool has(const std::vector<Column>& columns, std::string_view key) {
  return std::any_of(columns.begin(), columns.end(),
                     [&](const Column& column) { return column.key == key; });
}

std::string text_of(const Field& field) {
  return field.shown.empty() ? report::to_text(field.cell) : field.shown;
}

void add_unit(const std::string& unit, Field& to) {
  if (!unit.empty() && !to.shown.empty()) to.shown += " " + unit;
}

/// "preset 1" and "2.72 N.m": a head has a word, and perhaps a unit behind it.
std::string labelled(const Column& column, std::string text) {
  const std::size_t space = column.title.find(' ');
  const std::string unit = space == std::string::npos ? "" : column.title.substr(space);
  const bool is_unit = std::any_of(unit.begin(), unit.end(), [](char c) { return c >= 'a'; });
  if (is_unit) return text + unit;
  std::string label = column.title;
  for (char& c : label) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return label + " " + text;
}

/// What goes last where there is little room. The result and the count of NG stay.
constexpr std::uint8_t rank_of_kept = 250;
constexpr std::uint8_t rank_of_link = 251;
constexpr std::uint8_t rank_of_ok = 252;

/// Whole or not at all, so it is drawn as numbers are.
Column on_board(const Column& column) {
  report::Room room = report::left_out(column.room.rank == 0 ? rank_of_kept : column.room.rank);
  if (column.key == "result") room = {};
  return {"", column.key, Align::right, 0, room};
}

}  // namespace

WatchBoard::WatchBoard(std::vector<std::string> targets, const std::vector<Column>& columns) {
  for (std::string& target : targets) tools_.push_back({.target = std::move(target)});
  const bool has_results = has(columns, "result");
  columns_ = {{"", "target"}, {"", "link", Align::left, 0, report::left_out(rank_of_link)}};
  for (const Column& column : columns) {
    const bool is_kind = column.key == "kind" && !has_results;
    const bool is_left_out =
        std::find(not_of_result.begin(), not_of_result.end(), column.key) != not_of_result.end();
    if (is_left_out && !is_kind) continue;
    if (column.key == unit_key && !of_result_.empty()) {
      with_unit_ = of_result_.back().key;
      continue;
    }
    of_result_.push_back(column);
    columns_.push_back(on_board(column));
  }
  if (!has_results) return;
  columns_.push_back({"", "ok", Align::right, 0, report::left_out(rank_of_ok)});
  columns_.push_back({"", "ng", Align::right});
}

WatchBoard::Tool* WatchBoard::find(const std::string& target) {
  const auto found = std::find_if(tools_.begin(), tools_.end(),
                                  [&](const Tool& tool) { return tool.target == target; });
  return found == tools_.end() ? nullptr : &*found;
}

void WatchBoard::note(const Record& record, const std::string& preset_key) {
  Tool* const tool = find(record.target);
  if (tool == nullptr) return;
  if (record.type == "link") return note_link(record, *tool);
  if (record.type != "event" || record.find("remembered") != nullptr) return;
  const Field* const result = record.find("result");
  const std::string verdict = result == nullptr ? std::string() : report::to_text(result->cell);
  if (verdict == "OK") ++tool->ok;
  if (verdict == "NG") ++tool->ng;
  const bool counts = result == nullptr || !verdict.empty();
  for (const Column& column : of_result_) {
    const Field* const field = record.find(column.key);
    if (field == nullptr || !(counts || column.key == preset_key)) continue;
    note_cell(*field, column, *tool);
    const Field* const unit = column.key == with_unit_ ? record.find(unit_key) : nullptr;
    if (unit != nullptr) add_unit(text_of(*unit), tool->cells[column.key]);
  }
}

void WatchBoard::note_link(const Record& record, Tool& tool) const {
  const Field* const state = record.find("state");
  if (state == nullptr) return;
  tool.link = report::to_text(state->cell);
  tool.is_connected = tool.link == "connected";
  const Field* const attempt = record.find("attempt");
  const std::string tries = attempt == nullptr ? std::string() : report::to_text(attempt->cell);
  if (!tool.is_connected && !tries.empty() && tries != "0") tool.link += " (" + tries + ")";
}

void WatchBoard::note_cell(const Field& field, const Column& column, Tool& tool) const {
  Field noted = field;
  const std::string text = text_of(field);
  const bool is_word = column.key == "result" || column.key == "kind";
  noted.shown = text.empty() || is_word ? text : labelled(column, text);
  noted.cell = text;
  tool.cells[column.key] = std::move(noted);
}

Record WatchBoard::record_of(const Tool& tool) const {
  Record record{.type = {}, .target = tool.target, .time = {}, .fields = {}};
  record.fields.push_back(
      {.key = "link", .cell = tool.link, .tone = tool.is_connected ? Tone::plain : Tone::bad});
  for (const auto& [key, field] : tool.cells) record.fields.push_back(field);
  record.fields.push_back({"ok", fmt::format("{} OK", tool.ok)});
  record.fields.push_back({.key = "ng",
                           .cell = fmt::format("{} NG", tool.ng),
                           .tone = tool.ng > 0 ? Tone::bad : Tone::plain});
  return record;
}

std::string WatchBoard::rest_in_words(std::size_t from) const {
  std::size_t connected = 0;
  std::size_t ng = 0;
  for (std::size_t at = from; at < tools_.size(); ++at) {
    if (tools_[at].is_connected) ++connected;
    ng += tools_[at].ng;
  }
  return fmt::format("and {} more: {} connected, {} NG", tools_.size() - from, connected, ng);
}

std::vector<report::ScreenLine> WatchBoard::lines(std::size_t most, std::size_t room,
                                                  report::Color color) const {
  const bool all = tools_.size() <= most;
  const std::size_t shown = all ? tools_.size() : std::max<std::size_t>(most, 1) - 1;
  std::vector<Record> records;
  records.reserve(shown);
  for (std::size_t at = 0; at < shown; ++at) records.push_back(record_of(tools_[at]));
  auto lines = report::screen_lines(columns_, records, room, color);
  if (!all) lines.push_back(report::screen_line(rest_in_words(shown), room));
  return lines;
}

}  // namespace spindle::commands
