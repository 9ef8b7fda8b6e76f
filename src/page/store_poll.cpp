#include "page/store_poll.hpp"

#include <fmt/format.h>

#include <utility>

#include "page/recorder.hpp"
#include "spindle/catalogue/event_layout.hpp"
#include "spindle/report/record.hpp"

namespace spindle::page {
namespace {

using store::EventView;
using store::RowId;

/// How far back a chart may reach that the shift does not fill.
constexpr auto history = std::chrono::days(7);
/// Happenings that are looked at for what is the case now.
constexpr std::size_t recent_happenings = 20'000;
constexpr auto moves_within = std::chrono::seconds(45);
constexpr auto moves_after = std::chrono::seconds(2);

std::optional<std::int64_t> loosening_of(const catalogue::Profile& profile) {
  if (!profile.events) return std::nullopt;
  const catalogue::EventLayout layout(profile);
  for (const auto& field : layout.fields()) {
    if (field.key != store::column_words.text(store::Column::direction)) continue;
    for (const auto& label : field.parameter->labels) {
      if (label.text == "loosening") return label.number;
    }
  }
  return std::nullopt;
}

std::string problem_of(const Error& error) {
  return fmt::format("The store cannot be read: {}.", describe(error));
}

}  // namespace

Result<void> rows_between(commands::StoredRows& rows, const Position& from, const Position& until,
                          const std::function<bool(const Live::Told&)>& take) {
  Position at = from;
  store::Reader& reader = rows.reader();
  TRY_LET(const auto gaps, reader.gaps({.after = from.gap}));
  for (const store::Gap& gap : gaps) {
    if (gap.id > until.gap) break;
    at.gap = gap.id;
    if (!take({at, report::to_json(rows.gap(gap))})) return {};
  }
  bool goes_on = true;
  TRY(reader.happenings({.after = from.happening}, [&](const store::Happening& row) {
    if (row.id > until.happening) return false;
    at.happening = row.id;
    goes_on = take({at, report::to_json(rows.happening(row))});
    return goes_on;
  }));
  if (!goes_on) return {};
  return reader.events({.after = from.event}, [&](const EventView& row) {
    if (row.id > until.event) return false;
    at.event = row.id;
    return take({at, report::to_json(rows.event(row))});
  });
}

StorePoll::StorePoll(std::string path, ShiftTimes shifts, Live& live, commands::Context& context)
    : path_(std::move(path)), shifts_(std::move(shifts)), live_(&live), context_(context) {}

const ProductWords& StorePoll::words_of(const std::string& profile) {
  const auto found = words_.find(profile);
  if (found != words_.end()) return found->second;
  ProductWords words;
  const auto& profiles = context_.get().profiles;
  if (const auto known = profiles.load(profile)) {
    words.loosening = loosening_of(*known);
    if (auto tables = profiles.load_code_tables(profile)) words.codes = std::move(*tables);
  }
  return words_.emplace(profile, std::move(words)).first->second;
}

Recorder StorePoll::recorder() {
  const Recorder listed = recorder_of(path_);
  const TimePoint now = context_.get().clock.now();
  if (listed != Recorder::stopped) {
    stopped_since_.reset();
    return listed;
  }
  if (!stopped_since_) stopped_since_ = now;
  const bool moves =
      moved_at_ && *moved_at_ > *stopped_since_ + moves_after && *moved_at_ + moves_within > now;
  return moves ? Recorder::runs : Recorder::stopped;
}

void StorePoll::look() {
  const auto identity = identity_of(path_);
  if (identity != identity_) {
    identity_ = identity;
    rows_.reset();
  }
  if (!identity) return tell_absence();
  auto read = rows_ == nullptr ? open() : read_new();
  const WallTime now = context_.get().clock.wall();
  if (read && (now >= shift_.end || now < shift_.begin)) read = load();
  if (!read) {
    rows_.reset();
    return live_->situate(problem_of(read.error()), recorder());
  }
  live_->situate({}, recorder());
}

void StorePoll::tell_absence() {
  const WallTime now = context_.get().clock.wall();
  if (!loaded_ && (now >= shift_.end || now < shift_.begin)) {
    shift_ = shift_at(now, shifts_, context_.get().clock);
    live_->replace(Board(shift_,
                         [this](const std::string& profile) -> const ProductWords& {
                           return words_of(profile);
                         }),
                   {});
  }
  live_->situate(loaded_
                     ? fmt::format("The store {} is gone. What is shown was known before.", path_)
                     : fmt::format("There is no store yet: {}. This page shows what is "
                                   "recorded as soon as 'spindle record' has made it.",
                                   path_),
                 Recorder::unknown);
}

Result<void> StorePoll::open() {
  TRY_LET(rows_, commands::StoredRows::open(path_, context_.get()));
  return load();
}

/// What is known now, from the rows of this shift and the last ones before it.
Result<void> StorePoll::load() {
  const WallTime now = context_.get().clock.wall();
  const Shift shift = shift_at(now, shifts_, context_.get().clock);
  Board board(shift, [this](const std::string& profile) -> const ProductWords& {
    return words_of(profile);
  });
  store::Reader& reader = rows_->reader();
  Position position;
  TRY_LET(position.event, reader.newest());
  TRY(rows_->refresh());
  TRY(note_places(board));
  TRY(read_history(board, shift));
  TRY(reader.events({.since = shift.begin}, [&](const EventView& row) {
    if (row.id > position.event) return false;
    if (const auto* place = rows_->place(row.place)) board.note(row, *place);
    return true;
  }));
  TRY_LET(const auto newest_gap, reader.gaps({.newest = 1}));
  if (!newest_gap.empty()) position.gap = newest_gap.front().id;
  TRY_LET(const auto gaps, reader.gaps({.since = shift.begin}));
  for (const store::Gap& gap : gaps) {
    const auto* place = rows_->place_at(gap.tool, gap.ended);
    if (place != nullptr && gap.id <= position.gap) board.note(gap, *place);
  }
  TRY(reader.happenings({.newest = recent_happenings}, [&](const store::Happening& row) {
    position.happening = row.id;
    board.note(row, row.tool ? rows_->place_at(*row.tool, row.at) : nullptr);
    return true;
  }));
  static_cast<void>(board.take_said());
  shift_ = shift;
  position_ = position;
  const bool is_other = loaded_ && loaded_ != identity_;
  loaded_ = identity_;
  live_->replace(std::move(board), position,
                 is_other ? Live::Origin::other_store : Live::Origin::same_store);
  return {};
}

/// The last results of each tool before the shift, for its chart and what it holds.
Result<void> StorePoll::read_history(Board& board, const Shift& shift) {
  TRY_LET(const auto places, rows_->reader().places());
  std::set<RowId> tools;
  for (const store::Place& place : places) tools.insert(place.tool);
  for (const RowId tool : tools) {
    const store::Filter filter{.tools = {tool},
                               .since = shift.begin - history,
                               .until = shift.begin,
                               .newest = Board::most_recent};
    TRY(rows_->reader().events(filter, [&](const EventView& row) {
      if (const auto* place = rows_->place(row.place)) board.note(row, *place);
      return true;
    }));
  }
  return {};
}

Result<void> StorePoll::note_places(Board& board) {
  TRY_LET(const auto places, rows_->reader().places());
  for (const store::Place& place : places) board.note(place, rows_->tool(place.tool));
  return {};
}

/// The newest rows are asked for first: what is stored meanwhile belongs to the next look.
Result<void> StorePoll::read_new() {
  TRY(rows_->refresh());
  const Position before = position_;
  auto read = live_->advance(
      [this](Board& board, Position& position, std::vector<Live::Told>& told) -> Result<void> {
        TRY(note_places(board));
        store::Reader& reader = rows_->reader();
        const auto tell = [&](const report::Record& record) {
          told.push_back({position, report::to_json(record)});
        };
        TRY_LET(const auto gaps, reader.gaps({.after = position.gap}));
        for (const store::Gap& gap : gaps) {
          position.gap = gap.id;
          if (const auto* place = rows_->place_at(gap.tool, gap.ended)) board.note(gap, *place);
          tell(rows_->gap(gap));
        }
        TRY(reader.happenings({.after = position.happening}, [&](const store::Happening& row) {
          position.happening = row.id;
          board.note(row, row.tool ? rows_->place_at(*row.tool, row.at) : nullptr);
          tell(rows_->happening(row));
          return true;
        }));
        return reader.events({.after = position.event}, [&](const EventView& row) {
          position.event = row.id;
          if (const auto* place = rows_->place(row.place)) board.note(row, *place);
          tell(rows_->event(row));
          return true;
        });
      });
  position_ = live_->position();
  if (position_ != before) moved_at_ = context_.get().clock.now();
  return read;
}

}  // namespace spindle::page
