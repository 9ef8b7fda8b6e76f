#include "outbox.hpp"

#include <algorithm>
#include <string_view>
#include <utility>

#include "spindle/catalogue/profile.hpp"

namespace spindle::forward {
namespace {

using catalogue::EventKind;
using store::RowId;

constexpr std::size_t rows_of_part = 500;

/// Kinds of the events that a fastening ends with.
std::vector<std::string> result_kinds() {
  return {std::string(to_text(EventKind::fastening_ok)),
          std::string(to_text(EventKind::fastening_ng))};
}

bool is_result(std::string_view kind) {
  return kind == to_text(EventKind::fastening_ok) || kind == to_text(EventKind::fastening_ng);
}

store::Event copy_of(const store::EventView& row) {
  store::Event event = {.tool = row.tool,
                        .place = row.place,
                        .number = row.number,
                        .at = row.at,
                        .tool_time = row.tool_time,
                        .source = std::string(row.source),
                        .kind = std::string(row.kind),
                        .remembered = row.remembered,
                        .columns = row.columns,
                        .barcode = std::string(row.barcode)};
  for (std::size_t at = 0; at + 1 < row.raw.size(); at += 2) {
    event.raw.push_back(get_u16(row.raw, at));
  }
  return event;
}

report::Cell maybe_number(const std::optional<std::int64_t>& value) {
  return value ? report::number(*value) : report::Cell();
}

}  // namespace

Outbox::Outbox(commands::StoredRows& rows, std::string collector, Wants wants,
               const store::Positions& from, std::optional<store::Positions> until)
    : rows_(&rows),
      collector_(std::move(collector)),
      wants_(std::move(wants)),
      until_(until),
      loaded_(from),
      put_(from),
      positions_(from) {}

Result<void> Outbox::fill(std::size_t wanted) {
  // Asked before anything is read: what comes meanwhile changes it once more.
  TRY_LET(const auto state, rows_->reader().state());
  if (state != std::exchange(state_, state)) {
    TRY_LET(ends_, rows_->reader().ends());
    TRY(rows_->refresh());
    for (Stream* stream : {&gaps_, &happenings_, &events_}) stream->may_have_more = true;
  }
  while (parcels_.size() - gone_ < wanted) {
    TRY_LET(Stream* const stream, next());
    if (stream == nullptr) break;
    put(*stream);
  }
  return {};
}

std::span<const Parcel> Outbox::front(std::size_t most) const {
  return std::span(parcels_).subspan(gone_, std::min(most, parcels_.size() - gone_));
}

void Outbox::acknowledge(std::size_t count) {
  if (count == 0) return;
  gone_ += std::min(count, parcels_.size() - gone_);
  positions_ = behind_[gone_ - 1];
  if (gone_ < parcels_.size() && gone_ < rows_of_part) return;
  parcels_.erase(parcels_.begin(), parcels_.begin() + static_cast<std::ptrdiff_t>(gone_));
  behind_.erase(behind_.begin(), behind_.begin() + static_cast<std::ptrdiff_t>(gone_));
  gone_ = 0;
}

/// The stream whose first row is the oldest; null: all have ended. Gaps and happenings come before
/// events of the same time.
Result<Outbox::Stream*> Outbox::next() {
  Stream* oldest = nullptr;
  for (Stream* stream : {&gaps_, &happenings_, &events_}) {
    if (stream->rows.empty() && stream->may_have_more) {
      TRY(load(*stream));
    }
    if (stream->rows.empty()) continue;
    const bool is_older =
        oldest == nullptr || stream->rows.front().parcel.at < oldest->rows.front().parcel.at;
    if (is_older) oldest = stream;
  }
  return oldest;
}

void Outbox::put(Stream& stream) {
  Loaded row = std::move(stream.rows.front());
  stream.rows.pop_front();
  put_.*stream.place = row.parcel.id;
  if (row.is_wanted) {
    parcels_.push_back(std::move(row.parcel));
    behind_.push_back(put_);
  } else if (empty()) {
    positions_ = put_;
  } else {
    behind_.back() = put_;
  }
}

Result<void> Outbox::load(Stream& stream) {
  stream.may_have_more = false;
  if (&stream == &events_) return load_events();
  return &stream == &gaps_ ? load_gaps() : load_happenings();
}

bool Outbox::is_within(const Stream& stream, RowId id) const {
  return id <= ends_.*stream.place && (!until_ || id <= (*until_).*stream.place);
}

Result<void> Outbox::load_events() {
  Result<void> added;
  std::size_t rows = 0;
  auto read = rows_->reader().events({.after = loaded_.event}, [&](const store::EventView& row) {
    if (!is_within(events_, row.id)) return false;
    loaded_.event = row.id;
    ++rows;
    added = add_event(row);
    return added.has_value() && rows < rows_of_part;
  });
  TRY(std::move(read));
  TRY(std::move(added));
  events_.may_have_more = rows == rows_of_part;
  return {};
}

Result<void> Outbox::load_gaps() {
  TRY_LET(auto gaps, rows_->reader().gaps({.after = loaded_.gap}));
  for (store::Gap& gap : gaps) {
    if (!is_within(gaps_, gap.id)) return {};
    loaded_.gap = gap.id;
    Parcel parcel = {.id = gap.id, .at = gap.ended, .epoch = gap.epoch};
    name(parcel, gap.tool, rows_->place_at(gap.tool, gap.ended));
    parcel.row = gap;
    add(gaps_, std::move(parcel), [&] { return rows_->gap(gap); });
  }
  return {};
}

Result<void> Outbox::load_happenings() {
  std::size_t rows = 0;
  auto read =
      rows_->reader().happenings({.after = loaded_.happening}, [&](const store::Happening& row) {
        if (!is_within(happenings_, row.id)) return false;
        loaded_.happening = row.id;
        ++rows;
        Parcel parcel = {.id = row.id, .at = row.at};
        if (row.tool) name(parcel, *row.tool, rows_->place_at(*row.tool, row.at));
        parcel.row = row;
        add(happenings_, std::move(parcel), [&] { return rows_->happening(row); });
        return rows < rows_of_part;
      });
  TRY(std::move(read));
  happenings_.may_have_more = rows == rows_of_part;
  return {};
}

Result<void> Outbox::add_event(const store::EventView& row) {
  Parcel parcel = {.id = row.id, .at = row.at, .epoch = row.epoch};
  name(parcel, row.tool, rows_->place(row.place));
  parcel.is_result = is_result(row.kind);
  TRY_LET(parcel.previous, previous_result(row));
  parcel.row = copy_of(row);
  const std::int64_t seq = sequence_number(row.epoch, row.number);
  if (parcel.is_result) results_[row.tool] = seq;
  const auto previous = parcel.previous;
  const bool tells_previous = parcel.is_result;
  add(events_, std::move(parcel), [&] {
    report::Record record = rows_->event(row);
    record.fields.push_back({"seq", report::number(seq)});
    if (tells_previous) record.fields.push_back({"previous", maybe_number(previous)});
    return record;
  });
  return {};
}

/// Rows of a tool are in the order in which it counts; before the first that is read here the store
/// is asked.
Result<std::optional<std::int64_t>> Outbox::previous_result(const store::EventView& row) {
  const auto known = results_.find(row.tool);
  if (known != results_.end()) return known->second;
  TRY_LET(const auto before,
          rows_->reader().counted_before(row.tool, {.epoch = row.epoch, .number = row.number},
                                         result_kinds()));
  const auto seq =
      before ? std::optional(sequence_number(before->epoch, before->number)) : std::nullopt;
  results_[row.tool] = seq;
  return seq;
}

void Outbox::name(Parcel& parcel, RowId tool, const store::Place* place) const {
  const store::Tool* row = rows_->tool(tool);
  if (row != nullptr) parcel.tool = row->name;
  if (place == nullptr) return;
  parcel.target = place->name;
  parcel.torque_unit = place->torque_unit;
  parcel.fence = place->fence;
}

void Outbox::add(Stream& stream, Parcel parcel, const std::function<report::Record()>& record) {
  // What another collector recorded comes from its store, and is no gap of the plant's.
  const auto* gap = parcel.gap();
  const bool is_elsewhere = gap != nullptr && gap->reason == store::recorded_elsewhere;
  const bool is_wanted = !is_elsewhere && wants_(parcel);
  if (is_wanted) {
    report::Record told = record();
    told.fields.push_back({"collector", collector_});
    parcel.json = report::to_json(told);
  }
  stream.rows.push_back({.parcel = std::move(parcel), .is_wanted = is_wanted});
}

}  // namespace spindle::forward
