#include "result_stream.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "records.hpp"
#include "spindle/base/text.hpp"

namespace spindle::commands {
namespace {

using report::Record;
using store::EventView;
using store::RowId;

constexpr std::size_t rows_of_part = 500;

}  // namespace

ResultStream::ResultStream(store::Reader& reader, StoredRecords& records,
                           const Selection& selection, Told told, std::optional<std::size_t> newest)
    : reader_(&reader),
      records_(&records),
      selection_(&selection),
      told_(told),
      newest_(newest),
      filter_(selection.filter),
      gap_filter_{.tools = selection.filter.tools,
                  .since = selection.filter.since,
                  .until = selection.filter.until},
      happening_filter_(gap_filter_) {
  if (told == Told::gaps) gap_filter_.newest = newest;
  if (told != Told::all) happening_filter_.kinds = {"event"};  // of motors
}

/// What was stored meanwhile belongs to the next round. Gaps and all else are read behind that.
Result<void> ResultStream::tell_new(const Take& take) {
  TRY_LET(const auto newest, reader_->newest());
  last_ = newest;
  TRY(note_places());
  if (newest_ && told_ != Told::gaps) {
    TRY(find_begin());
  }
  TRY(read_others());
  const auto flush = [&] {
    const bool goes_on = std::all_of(part_.begin(), part_.end(), take);
    part_.clear();
    return goes_on;
  };
  if (told_ != Told::gaps) {
    for (std::size_t rows = rows_of_part; rows == rows_of_part;) {
      TRY_LET(const auto read, read_part());
      rows = read;
      if (!flush()) return {};
    }
  }
  for (; next_other_ < others_.size(); ++next_other_) tell(others_[next_other_]);
  flush();
  filter_.after = std::max(filter_.after, last_);
  is_first_event_ = false;
  others_.clear();
  next_other_ = 0;
  gap_before_.clear();
  return {};
}

/// A tool that is meant may be reached in another way by now.
Result<void> ResultStream::note_places() {
  TRY_LET(const auto fresh, records_->refresh(*reader_));
  for (const store::Place* place : fresh) {
    if (selection_->names.contains(place->name)) filter_.places.push_back(place->id);
  }
  return {};
}

/// Of the newest so many, the first one.
Result<void> ResultStream::find_begin() {
  store::Filter filter = filter_;
  filter.newest = std::exchange(newest_, std::nullopt);
  RowId first = last_ + 1;
  auto read = reader_->events(filter, [&](const EventView& row) {
    first = row.id;
    return false;
  });
  filter_.after = first - 1;
  return read;
}

Result<void> ResultStream::read_others() {
  TRY(read_gaps());
  if (told_ != Told::gaps) {
    TRY(read_happenings());
  }
  std::stable_sort(others_.begin(), others_.end(),
                   [](const Other& a, const Other& b) { return a.at < b.at; });
  for (std::size_t index = 0; index < others_.size(); ++index) {
    const auto& gap = others_[index].gap;
    if (gap && gap->before) gap_before_[{gap->tool, gap->epoch, *gap->before}] = index;
  }
  return {};
}

Result<void> ResultStream::read_gaps() {
  if (filter_.number) return {};  // one result misses nothing
  TRY_LET(auto gaps, reader_->gaps(gap_filter_));
  gap_filter_.newest = std::nullopt;
  for (store::Gap& gap : gaps) {
    gap_filter_.after = gap.id;
    if (!selection_->has(records_->place_at(gap.tool, gap.ended))) continue;
    Record record = records_->gap(gap);
    others_.push_back({.at = gap.ended,
                       .record = std::move(record),
                       .is_shown = told_ == Told::gaps || !selection_->is_about_content,
                       .gap = std::move(gap)});
  }
  return {};
}

Result<void> ResultStream::read_happenings() {
  if (selection_->is_about_content) return {};
  return reader_->happenings(happening_filter_, [&](const store::Happening& row) {
    happening_filter_.after = row.id;
    Record record = records_->happening(row);
    const bool is_meant = selection_->names.empty() || selection_->names.contains(record.target);
    if (is_meant) others_.push_back({.at = row.at, .record = std::move(record)});
    return true;
  });
}

Result<std::size_t> ResultStream::read_part() {
  std::size_t rows = 0;
  auto read = reader_->events(filter_, [&](const EventView& row) {
    if (row.id > last_) return false;
    if (is_first_event_) forget_older(row);
    tell_before(row);
    note(row);
    part_.push_back(records_->event(row));
    filter_.after = row.id;
    return ++rows < rows_of_part;
  });
  if (!read) return tl::unexpected(read.error());
  return rows;
}

/// Before the newest so many there is nothing to tell but the gap that the first of them made
/// known.
void ResultStream::forget_older(const EventView& row) {
  is_first_event_ = false;
  if (filter_.after == 0) return;
  while (next_other_ < others_.size() && others_[next_other_].at < row.at) ++next_other_;
}

void ResultStream::tell_before(const EventView& row) {
  while (next_other_ < others_.size() && others_[next_other_].at <= row.at) {
    tell(others_[next_other_++]);
  }
  const auto gap = gap_before_.find({row.tool, row.epoch, row.number});
  if (gap != gap_before_.end()) tell(others_[gap->second]);
}

void ResultStream::tell(Other& other) {
  if (std::exchange(other.is_told, true)) return;
  if (other.gap) {
    ++gaps_;
    missed_ += other.gap->missed.value_or(0);
    if (!other.gap->missed || other.gap->at_least) ++unknown_gaps_;
  }
  if (other.is_shown) part_.push_back(std::move(other.record));
}

void ResultStream::note(const EventView& row) {
  ++events_;
  if (row.remembered) {
    ++remembered_;
    return;
  }
  if (row.kind == "fastening-ok") ++ok_;
  if (row.kind == "fastening-ng") ++ng_;
}

std::vector<report::Field> ResultStream::counts() const {
  return {{"events", count(events_)},
          {"ok", count(ok_)},
          {"ng", count(ng_)},
          {"remembered", count(remembered_)},
          {"gaps", count(gaps_)},
          {"missed", count(missed_)},
          {"unknown_gaps", count(unknown_gaps_)}};
}

std::string ResultStream::sentence() const {
  std::string text = fmt::format("{}, {} OK, {} NG, ", counted(events_, "event"), ok_, ng_);
  if (remembered_ > 0) text += fmt::format("{} of unknown age, ", remembered_);
  const std::string missed = unknown_gaps_ == 0 ? fmt::format("{} missed", missed_)
                             : missed_ == 0     ? "perhaps some missed"
                                                : fmt::format("at least {} missed", missed_);
  return text + fmt::format("{}, {}", counted(gaps_, "gap"), missed);
}

}  // namespace spindle::commands
