#include "recorder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "records.hpp"

namespace spindle::commands {
namespace {

/// How often it is stored until when a tool was listened to.
constexpr Duration seen_every = std::chrono::seconds(10);
/// Another client may change settings unseen, so they are read again behind a result.
constexpr Duration settings_every = std::chrono::minutes(1);
/// A link that is lost over the settings so often is worth more without them.
constexpr unsigned most_unanswered = 3;
/// People are told of one tool's link at most so often.
constexpr Duration link_told_every = std::chrono::minutes(1);

/// The link is opened again a moment later.
Error not_settled(std::string message) {
  return {.code = Errc::storage, .message = std::move(message)};
}

}  // namespace

Recorder::Recorder(store::Writer& writer, WatchStream& stream, ServiceNews& news,
                   work::JournalOptions options, Context& context)
    : writer_(&writer),
      stream_(&stream),
      news_(&news),
      context_(&context),
      timed_(writer, counters_, context.clock),
      journal_(
          timed_, std::move(options),
          [this](const store::Entry& entry, const store::Stored& stored) {
            if (const auto* gap = std::get_if<store::NewGap>(&entry)) tell_gap(*gap, stored);
          },
          [this](const std::optional<Error>& error) { tell_trouble(error); }) {}

void Recorder::tell_trouble(const std::optional<Error>& error) {
  const bool waits =
      error && (error->status() == ExitStatus::storage || error->status() == ExitStatus::bad_file);
  news_->trouble(waits);
  if (error) {
    stream_->fault(*error);
  } else {
    stream_->note("the store can be written again; what waited is stored");
  }
}

RecordedTool& Recorder::recorded(const Target& target) {
  const std::lock_guard lock(mutex_);
  const auto known = std::find_if(recorded_.begin(), recorded_.end(),
                                  [&](const auto& one) { return one->entry() == target; });
  if (known != recorded_.end()) return **known;
  return *recorded_.emplace_back(std::make_unique<RecordedTool>(target, *this));
}

Result<store::ToolName> Recorder::claim(const store::ToolName& said, const std::string& target,
                                        const RecordedTool& listener) {
  const store::ToolName own = {said.maker, fmt::format("{}@{}", said.serial, target)};
  TRY_LET(const bool has_own, writer_->has_tool(own));
  std::string holder;
  bool is_news = false;
  {
    const std::lock_guard lock(mutex_);
    const auto other = std::find_if(claims_.begin(), claims_.end(), [&](const auto& claim) {
      return claim.second.name == said && claim.first != target;
    });
    if (other != claims_.end()) holder = other->first;
    if (!holder.empty() && other->second.listener->is_leaving()) {
      return tl::unexpected(not_settled("it was known by another name, which is being left"));
    }
    // A tool that moved is met once more before its old link is known to be dead.
    const bool is_first = !holder.empty() && !has_own && met_.insert({target, said}).second;
    if (is_first) {
      return tl::unexpected(not_settled(
          "another tool that is connected says its serial number: it is looked at again"));
    }
    claims_.insert_or_assign(target, Claim{holder.empty() && !has_own ? said : own, &listener});
    is_news = !holder.empty() && told_.insert(own).second;
  }
  if (is_news) {
    stream_->fault(Error{
        .code = Errc::mismatch,
        .message = fmt::format("serial number {} is also that of {}: its results are recorded "
                               "under the serial number '{}'",
                               said.serial, holder, own.serial),
        .hint = "give every tool a serial number of its own",
        .target = target});
  }
  return holder.empty() && !has_own ? said : own;
}

Result<void> Recorder::settle(store::RowId tool, RecordedTool& listener) {
  const std::lock_guard lock(mutex_);
  const auto found = listeners_.find(tool);
  const bool is_new = found == listeners_.end() || found->second != &listener;
  const bool has_to_know = is_new || !listener.is_of(tool) || !listener.is_informed();
  if (has_to_know && journal_.waits_for(tool)) {
    return tl::unexpected(not_settled("what the tool told before is still being stored"));
  }
  listeners_.insert_or_assign(tool, &listener);
  return {};
}

/// A gap that the journal itself made.
void Recorder::tell_gap(const store::NewGap& entry, const store::Stored& stored) {
  RecordedTool* listener = nullptr;
  {
    const std::lock_guard lock(mutex_);
    const auto found = listeners_.find(entry.gap.tool);
    if (found != listeners_.end()) listener = found->second;
  }
  if (listener == nullptr) return;
  counters_.note_stored(listener->entry().shown, entry.gap);
  listener->tell_gap(work::news_of(entry.gap), stored);
}

void Recorder::release(const std::string& target) {
  const std::lock_guard lock(mutex_);
  claims_.erase(target);
}

RecordedTool::RecordedTool(const Target& target, Recorder& recorder)
    : entry_(target), target_(target), recorder_(&recorder) {
  voice_.records.emplace(target_, unknown_, catalogue::CodeTables());
}

void RecordedTool::begin(Task& task) {
  task_ = &task;
  recorder_->counters().begin(entry_.shown);
  is_informed_ = false;
  is_up_ = false;
  link_text_.reset();
  noted_at_.reset();
}

TimePoint RecordedTool::until() {
  return is_leaving() ? TimePoint::min() : recorder_->stream().until();
}

void RecordedTool::opened(const WatchedTool& tool) {
  if (profile_ == &tool.known()->profile) return;
  const std::lock_guard lock(voice_mutex_);
  profile_ = &tool.known()->profile;
  target_ = tool.target();
  voice_.records.emplace(target_, *profile_, tool.known()->tables);
  rows_.reset();
  if (profile_->events) rows_.emplace(*profile_);
}

device::WatchControl RecordedTool::tell(const device::WatchEvent& news) {
  std::visit([this](const auto& one) { record(one); }, news);
  return device::WatchControl::go_on;
}

void RecordedTool::left(const Result<void>& watched, const std::optional<Error>& unreached) {
  flush_gap();
  flush_link();
  // Of a tool that is not connected it is not known what it did until now.
  if (tool_ && is_up_) recorder_->journal().add_lazily(store::Seen{*tool_, now()});
  if (is_up_ && is_leaving()) {
    const device::LinkChange news = {device::LinkState::lost, 0,
                                     "it is not recorded here any more"};
    happen(voice_.records->link(news, now()), news);
  }
  recorder_->release(target_.shown);
  recorder_->counters().note_link(entry_.shown, false);
  if (is_leaving()) recorder_->counters().leave(entry_.shown);
  task_->note_tried();
  const std::lock_guard lock(voice_mutex_);
  // A signal is how a recorder is usually ended.
  const bool as_asked = is_leaving() || recorder_->context().interrupt.signalled();
  recorder_->stream().leave(as_asked ? Result<void>() : watched,
                            as_asked ? std::nullopt : unreached, voice_);
}

device::RecordHooks RecordedTool::hooks() {
  return {.on_connected = [this](device::Device& device) { return register_tool(device); },
          .errand = [this] { return next_errand(); }};
}

// ---- what the tool tells ----

void RecordedTool::record(const device::ToolEvent& news) {
  store::Event row = rows_->row(news);
  if (!adopt_unit(news.block)) {
    // A number with another unit would be a wrong one. The block has them all.
    for (const auto& [word, column] : store::column_words) {
      if (work::is_torque(column)) row.columns[column].reset();
    }
  }
  row.tool = *tool_;
  row.place = place_;
  auto begins = epochs_.begins();
  if (!news.number) {
    const bool wraps = counted_ == std::numeric_limits<std::uint16_t>::max();
    counted_ = counted_ ? static_cast<std::uint16_t>(*counted_ + 1) : std::uint16_t{1};
    row.number = *counted_;
    if (wraps) begins = store::EpochReason::wrap;
  }
  store::NewEvent entry = {std::move(row), begins};
  if (gap_) entry.gap = work::row_of(*gap_, seen_, news.time);
  gap_.reset();
  seen_ = news.time;
  want_settings(news);
  recorder_->journal().add(
      std::move(entry), [this, news, serial = serial_](const store::Entry& stored_entry,
                                                       const store::Stored& stored) {
        const auto& event = std::get<store::NewEvent>(stored_entry);
        if (stored.as == store::Stored::As::known) return;
        recorder_->counters().note_stored(entry_.shown, event.event);
        if (event.gap) {
          recorder_->counters().note_stored(entry_.shown, *event.gap);
          tell_stream(work::news_of(*event.gap), serial, stored.epoch, stored.gap);
        }
        tell_stream(news, serial, stored.epoch, stored.id);
      });
}

/// An event is of a place whose torques have its unit. False where there is none and it cannot be
/// made.
bool RecordedTool::adopt_unit(const Registers& block) {
  const std::string unit = voice_.records->torque_unit_of(block);
  if (unit == place_row_.torque_unit) return true;
  store::Place other = place_row_;
  other.torque_unit = unit;
  other.since = now();
  const auto place = recorder_->writer().place(other);
  if (!place) return false;
  place_row_ = std::move(other);
  place_ = *place;
  return true;
}

/// It goes behind its event. What belongs to none is told, and not kept.
void RecordedTool::record(const device::ToolCurve& news) {
  if (!news.block || !news.number || !tool_) {
    tell_stream(news, serial_, 0, 0);
    return;
  }
  report::Record header = voice_.records->curve_header(news, {.serial = serial_});
  const report::Field* sampling = header.find("sampling_ms");
  const auto* interval = sampling == nullptr ? nullptr : std::get_if<Decimal>(&sampling->cell);
  constexpr std::int64_t us_in_ms = 1000;
  store::Curve curve = {
      .interval_us =
          interval == nullptr ? 0 : interval->divided_by(Decimal(1)).value_or(0) * us_in_ms,
      .channels = report::to_json(header)};
  for (const Bytes& channel : news.channels) {
    curve.samples.insert(curve.samples.end(), channel.begin(), channel.end());
  }
  recorder_->journal().add(
      store::NewCurve{.tool = *tool_, .number = *news.number, .curve = std::move(curve)},
      [this, news, serial = serial_](const store::Entry&, const store::Stored& stored) {
        if (stored.as == store::Stored::As::known) return;
        tell_stream(news, serial, stored.epoch, stored.id);
      });
}

void RecordedTool::record(const device::EventGap& news) {
  flush_gap();
  epochs_.note(news);
  gap_ = news;
}

void RecordedTool::record(const device::LinkChange& news) {
  flush_gap();
  flush_link();
  note_link(news);
  task_->note_tried();
  if (news.state == device::LinkState::lost) recorder_->release(target_.shown);
  link_ = news;
  // What the tool is is known right behind a connection.
  if (news.state != device::LinkState::connected) flush_link();
}

void RecordedTool::record(const device::PolledValue& news) {
  // What it points to ends with the watch, and the journal may tell it later.
  add_happening(voice_.records->value(news, "change", now()),
                [this, news, serial = serial_, parameter = *news.parameter](
                    const store::Entry&, const store::Stored& stored) {
                  device::PolledValue kept = news;
                  kept.parameter = &parameter;
                  tell_stream(kept, serial, stored.epoch, stored.id);
                });
}

void RecordedTool::record(const device::PollLag& news) {
  happen(voice_.records->lag(news, now()), news);
}

void RecordedTool::record(const device::MotorTransition& news) {
  happen(voice_.records->motor(news), news);
}

void RecordedTool::happen(const report::Record& record, device::WatchEvent news) {
  add_happening(record, [this, news = std::move(news), serial = serial_](
                            const store::Entry&, const store::Stored& stored) {
    tell_stream(news, serial, stored.epoch, stored.id);
  });
}

void RecordedTool::add_happening(const report::Record& record, work::Journal::Told told) {
  recorder_->journal().add(
      store::Happening{
          .tool = tool_, .at = record.time, .type = record.type, .json = report::to_json(record)},
      std::move(told));
}

/// A gap that no event stands behind.
void RecordedTool::flush_gap() {
  if (!gap_ || !tool_) return;
  const device::EventGap news = *std::exchange(gap_, std::nullopt);
  store::Gap row = work::row_of(news, seen_, now());
  row.tool = *tool_;
  seen_ = row.ended + std::chrono::milliseconds(1);  // two gaps without numbers are never one
  recorder_->journal().add(
      store::NewGap{std::move(row)},
      [this, news, serial = serial_](const store::Entry& entry, const store::Stored& stored) {
        if (stored.as == store::Stored::As::known) return;
        recorder_->counters().note_stored(entry_.shown, std::get<store::NewGap>(entry).gap);
        tell_stream(news, serial, stored.epoch, stored.id);
      });
}

void RecordedTool::flush_link() {
  if (!link_) return;
  const device::LinkChange news = *std::exchange(link_, std::nullopt);
  happen(voice_.records->link(news, now()), news);
}

void RecordedTool::tell_gap(const device::EventGap& news, const store::Stored& stored) {
  std::string serial;
  {
    const std::lock_guard lock(voice_mutex_);
    serial = serial_;
  }
  tell_stream(news, serial, stored.epoch, stored.id);
}

void RecordedTool::tell_stream(const device::WatchEvent& news, const std::string& serial,
                               std::int64_t epoch, store::RowId id) {
  const std::lock_guard lock(voice_mutex_);
  voice_.naming = {.serial = serial, .epoch = epoch, .id = id};
  recorder_->stream().tell(news, voice_);
}

// ---- what the record knows ----

Result<device::RecordedPast> RecordedTool::register_tool(device::Device& device) {
  flush_gap();
  store::Writer& writer = recorder_->writer();
  const store::ToolName said = work::name_of(device, target_.shown);
  TRY_LET(const auto name, recorder_->claim(said, target_.shown, *this));
  const auto& identity = device.identity();
  TRY_LET(const auto tool, writer.tool(name, identity ? identity->tool_model : std::string()));
  const std::optional<std::uint32_t> firmware = identity ? identity->firmware : std::nullopt;
  TRY_LET(const auto number_of_lease, fence());
  const store::Place row = {.tool = tool,
                            .name = target_.shown,
                            .url = target_.endpoint.text,
                            .profile = profile_->id.to_string(),
                            .firmware = firmware,
                            .torque_unit = target_.torque_unit,
                            .since = now(),
                            .fence = number_of_lease};
  TRY_LET(const auto place, writer.place(row));
  TRY(recorder_->settle(tool, *this));
  TRY_LET(const auto last, known_last(tool, name));
  {
    const std::lock_guard lock(voice_mutex_);
    serial_ = name.serial;
  }
  if (tool_ != tool) {
    epochs_ = {};
    counted_ = last ? std::optional(last->number) : std::nullopt;
    seen_ = last ? last->seen : now();
    wanted_.clear();
    read_at_.clear();
    unanswered_ = 0;
  }
  tool_ = tool;
  place_ = place;
  place_row_ = row;
  is_informed_ = true;
  flush_link();
  // Where events still wait to be stored, the last one that is stored is none to count from.
  if (identity && recorder_->journal().waiting() == 0) record_total(*identity, last);
  if (rows_) {
    for (const std::int64_t preset : rows_->presets()) want_settings(preset);
  }
  device::RecordedPast past = {.wants_first = true};
  if (last) past.last = work::last_event_of(*last, now());
  return past;
}

/// Empty: the tools are not shared.
Result<std::optional<std::int64_t>> RecordedTool::fence() const {
  if (recorder_->leases() == nullptr) return std::optional<std::int64_t>();
  const auto number = recorder_->leases()->fence(entry_.shown);
  if (!number) return tl::unexpected(not_settled("the lease of the tool has ended"));
  return number;
}

/// The last that the tool told this collector or another one.
Result<std::optional<store::Last>> RecordedTool::known_last(store::RowId tool,
                                                            const store::ToolName& name) {
  TRY_LET(auto own, recorder_->writer().last(tool));
  if (recorder_->leases() == nullptr) return own;
  TRY_LET(auto other, recorder_->leases()->last(name));
  if (!other) return own;
  const auto place = [](const store::Last& last) { return std::pair(last.epoch, last.number); };
  if (own && place(*own) > place(*other)) return own;
  const bool is_behind = !own || place(*own) < place(*other);
  if (own) other->seen = std::max(other->seen, own->seen);
  if (is_behind) {
    TRY(recorder_->writer().adopt(tool, *other));
    epochs_ = {};
    counted_ = other->number;
    seen_ = other->seen;
  } else if (own->block) {
    return own;
  }
  return other;
}

/// The tool's own count of its fastenings, by which it can be checked whether results are missing.
void RecordedTool::record_total(const catalogue::Identity& identity,
                                const std::optional<store::Last>& last) {
  if (!identity.total) return;
  report::Record record = {.type = "total", .target = target_.shown, .time = now(), .fields = {}};
  record.fields = {{"serial", serial_},
                   {"total", number(*identity.total)},
                   {"epoch", last ? number(last->epoch) : report::Cell()},
                   {"number", last ? number(last->number) : report::Cell()}};
  add_happening(record, {});
}

/// A result is worth more with the settings that it was made by.
void RecordedTool::want_settings(const device::ToolEvent& news) {
  const auto preset = rows_->preset_of(news.block);
  const auto& presets = rows_->presets();
  if (!preset || std::find(presets.begin(), presets.end(), *preset) == presets.end()) return;
  if (rows_->is_preset_change(news.block)) read_at_.erase(*preset);
  want_settings(*preset);
}

void RecordedTool::want_settings(std::int64_t preset) {
  if (std::find(wanted_.begin(), wanted_.end(), preset) != wanted_.end()) return;
  const auto read = read_at_.find(preset);
  const bool is_old =
      read == read_at_.end() || recorder_->context().clock.now() >= read->second + settings_every;
  if (is_old) wanted_.push_back(preset);
}

/// The settings of all presets are read at first, a few at a time, so that no event waits for long.
std::optional<device::Errand> RecordedTool::next_errand() {
  const TimePoint clock_now = recorder_->context().clock.now();
  if (tool_ && is_up_ && clock_now >= seen_due_) {
    seen_due_ = clock_now + seen_every;
    recorder_->journal().add_lazily(store::Seen{*tool_, now()});
  }
  note_pending();
  if (wanted_.empty() || !rows_ || unanswered_ > most_unanswered) return std::nullopt;
  if (++unanswered_ > most_unanswered) {
    recorder_->stream().note(fmt::format(
        "{}: the settings of its presets cannot be read, so its results are kept without limits",
        target_.shown));
    return std::nullopt;
  }
  constexpr std::size_t at_once = 8;
  const std::size_t count = std::min(at_once, wanted_.size());
  const std::vector<std::int64_t> presets(wanted_.begin(),
                                          wanted_.begin() + static_cast<std::ptrdiff_t>(count));
  wanted_.erase(wanted_.begin(), wanted_.begin() + static_cast<std::ptrdiff_t>(count));
  std::vector<catalogue::Parameter> parameters;
  for (const std::int64_t preset : presets) {
    read_at_.insert_or_assign(preset, clock_now);
    for (auto& parameter : rows_->settings_of(preset)) parameters.push_back(std::move(parameter));
  }
  return device::Errand{.wanted = std::move(parameters),
                        .take = [this, presets](const std::vector<device::Reading>& readings) {
                          unanswered_ = 0;
                          for (const std::int64_t preset : presets) {
                            auto row = rows_->settings_row(preset, readings);
                            if (!row) continue;
                            row->tool = *tool_;
                            row->since = now();
                            recorder_->journal().add(*row);
                          }
                        }};
}

// ---- what people are told ----

void RecordedTool::note_link(const device::LinkChange& news) {
  const bool is_up = news.state == device::LinkState::connected;
  const bool is_first = !noted_at_ && !link_text_;
  if (is_up != is_up_ || is_first) {
    is_up_ = is_up;
    recorder_->counters().note_link(entry_.shown, is_up);
    link_text_ = is_up ? news.message : "no link: " + news.message;
  }
  note_pending();
}

void RecordedTool::note_pending() {
  const TimePoint clock_now = recorder_->context().clock.now();
  if (!link_text_ || (noted_at_ && clock_now < *noted_at_ + link_told_every)) return;
  noted_at_ = clock_now;
  recorder_->stream().note(
      fmt::format("{}: {}", target_.shown, *std::exchange(link_text_, std::nullopt)));
}

}  // namespace spindle::commands
