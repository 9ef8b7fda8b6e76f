#include "watch_stream.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <variant>

#include "records.hpp"
#include "spindle/base/text.hpp"

namespace spindle::commands {
namespace {

using device::WatchControl;

/// Whether the tool gave it away: then it is told, or lost.
bool is_only_here(const device::WatchEvent& news) {
  const auto* event = std::get_if<device::ToolEvent>(&news);
  const auto* gap = std::get_if<device::EventGap>(&news);
  return (event != nullptr && event->is_only_here) || (gap != nullptr && gap->is_only_here);
}

}  // namespace

WatchStream::WatchStream(const WatchOptions& options, std::size_t tools,
                         const std::vector<report::Column>& columns, Context& context,
                         Records records)
    : options_(&options),
      context_(&context),
      records_(records),
      tools_(tools),
      status_(context),
      out_(context.io, context.interrupt),
      listing_(context, columns),
      started_(context.clock.now()),
      last_event_(started_) {}

WatchStream::WatchStream(const WatchOptions& options, const std::vector<std::string>& targets,
                         const std::vector<report::Column>& columns, Context& context)
    : WatchStream(options, targets.size(), columns, context) {
  const bool is_wanted = status_.is_shown() && context.io.out_is_terminal &&
                         context.user.frames == Frames::hidden &&
                         report::is_table(context.user.format) && listing_.open();
  if (!is_wanted) return;
  board_.emplace(targets, columns);
  show_status();
}

WatchControl WatchStream::tell(const device::WatchEvent& news, Voice& voice) {
  const std::lock_guard lock(mutex_);
  if (ended_ && !is_only_here(news)) return WatchControl::stop;
  if (out_.is_full()) {
    drop(news, voice.dropped);
    return WatchControl::go_on;
  }
  status_.clear();
  tell_dropped(voice);
  report::Record record = std::visit([&](const auto& one) { return record_of(one, voice); }, news);
  if (context_->user.format == report::Format::csv && record.type == "event") {
    voice.records->add_units(record);
  }
  if (records_ == Records::shown) listing_.add(record);
  note_board(record, voice);
  show_status();
  const bool counted = options_->count > 0 && activity_ >= options_->count;
  if (counted || !listing_.open()) end();
  return ended_ ? WatchControl::stop : WatchControl::go_on;
}

/// How the watch of one tool ended. `unreached` says why there never was a link to it.
void WatchStream::leave(const Result<void>& watched, const std::optional<Error>& unreached,
                        Voice& voice) {
  const std::lock_guard lock(mutex_);
  status_.clear();
  tell_dropped(voice);
  // Once the whole ends, it is we who interrupt the others.
  const bool ends_well = watched || ended_;
  const bool asked_to_end = !ends_well && (watched.error().status() == ExitStatus::interrupted ||
                                           watched.error().status() == ExitStatus::terminated);
  if (unreached && !closed_ && (ends_well || asked_to_end)) {
    outcome_.fail(*unreached);
    listing_.add(*unreached);
  } else if (ends_well) {
    outcome_.succeed();
  }
  if (ends_well) return;
  outcome_.fail(watched.error());
  if (!asked_to_end) listing_.add(watched.error());
}

void WatchStream::expect(std::size_t tools) {
  const std::lock_guard lock(mutex_);
  tools_ = tools;
  show_status();
}

void WatchStream::fault(const Error& error) {
  const std::lock_guard lock(mutex_);
  status_.clear();
  listing_.add(error);
  show_status();
}

void WatchStream::fail(const Error& error) {
  fault(error);
  const std::lock_guard lock(mutex_);
  outcome_.fail(error);
}

void WatchStream::note(std::string_view sentence) {
  const std::lock_guard lock(mutex_);
  status_.clear();
  context_->renderer.note(sentence);
  show_status();
}

/// When to end, as far as is known now.
TimePoint WatchStream::until() {
  const std::lock_guard lock(mutex_);
  if (context_->io.out_is_open && !context_->io.out_is_open()) {
    closed_ = true;
    end();
  }
  if (ended_) return TimePoint::min();
  if (board_ && !out_.is_full() && status_.screen() != drawn_on_) show_status();
  TimePoint until = TimePoint::max();
  if (options_->duration) until = started_ + *options_->duration;
  if (options_->idle_timeout) until = std::min(until, last_event_ + *options_->idle_timeout);
  return until;
}

Result<Outcome> WatchStream::finish() {
  status_.clear();
  if (closed_) return tl::unexpected(Error{.code = Errc::closed_pipe});
  TRY(listing_.end());
  const bool idle =
      options_->idle_timeout && context_->clock.now() >= last_event_ + *options_->idle_timeout;
  if (idle && activity_ == 0) outcome_.negate();
  TRY_LET(const auto left, out_.drain());
  if (left > 0) return give_up(left);
  TRY(summarise());
  return out_.drain().map([&](std::size_t) { return outcome_; });
}

report::Record WatchStream::record_of(const device::ToolEvent& news, const Voice& voice) {
  report::Record record = voice.records->event(news, voice.naming);
  if (news.standing != device::Standing::result) {
    ++counts_.remembered;
    return record;
  }
  if (news.source == device::EventOrigin::catch_up) ++counts_.caught_up;
  const catalogue::EventKind kind = voice.records->kind_of(news.block);
  ++counts_.events;
  if (kind == catalogue::EventKind::fastening_ok) ++counts_.ok;
  if (kind == catalogue::EventKind::fastening_ng) ++counts_.ng;
  note_activity();
  return record;
}

report::Record WatchStream::record_of(const device::MotorTransition& news, const Voice& voice) {
  ++counts_.events;
  note_activity();
  return voice.records->motor(news);
}

report::Record WatchStream::record_of(const device::PolledValue& news, const Voice& voice) {
  const bool sample = options_->samples == device::Samples::all;
  ++(sample ? counts_.samples : counts_.changes);
  note_activity();
  return voice.records->value(news, sample ? "sample" : "change", context_->clock.wall());
}

report::Record WatchStream::record_of(const device::EventGap& news, const Voice& voice) {
  ++counts_.gaps;
  return voice.records->gap(news, context_->clock.wall(), voice.naming);
}

report::Record WatchStream::record_of(const device::PollLag& news, const Voice& voice) {
  counts_.missed_intervals += news.missed;
  return voice.records->lag(news, context_->clock.wall());
}

/// Thousands of numbers are only written where there is a reader.
report::Record WatchStream::record_of(const device::ToolCurve& news, const Voice& voice) const {
  return records_ == Records::shown ? voice.records->curve(news, voice.naming)
                                    : voice.records->curve_header(news, voice.naming);
}

report::Record WatchStream::record_of(const device::LinkChange& news, const Voice& voice) {
  note_link(news);
  return voice.records->link(news, context_->clock.wall());
}

void WatchStream::note_link(const device::LinkChange& news) {
  if (news.state == device::LinkState::lost) {
    ++counts_.losses;
    --connected_;
  }
  if (news.state == device::LinkState::connected) ++connected_;
}

/// Something came, as --count and --idle-timeout mean it.
void WatchStream::note_activity() {
  ++activity_;
  last_event_ = context_->clock.now();
}

void WatchStream::drop(const device::WatchEvent& news, Dropped& dropped) {
  ++dropped.records;
  if (const auto* link = std::get_if<device::LinkChange>(&news)) note_link(*link);
  std::optional<std::uint32_t> events = 0;
  if (std::holds_alternative<device::ToolEvent>(news) ||
      std::holds_alternative<device::MotorTransition>(news)) {
    events = 1;
  }
  if (const auto* gap = std::get_if<device::EventGap>(&news)) events = gap->missed;
  if (!events) dropped.events.reset();
  if (dropped.events) *dropped.events += *events;
}

/// In the place of what was not told.
void WatchStream::tell_dropped(Voice& voice) {
  if (voice.dropped.records == 0) return;
  const Dropped dropped = std::exchange(voice.dropped, {});
  ++counts_.gaps;
  report::Record record = voice.records->gap(
      {.missed = dropped.events,
       .reason = fmt::format("{} not told, because the reader did not take what was told before",
                             counted(dropped.records, "record"))},
      context_->clock.wall(), voice.naming);
  record.fields.push_back({"dropped", count(dropped.records)});
  listing_.add(record);
}

void WatchStream::note_board(const report::Record& record, const Voice& voice) {
  if (board_) board_->note(record, voice.records->preset_key());
}

/// Under the events, which scroll above it.
void WatchStream::show_board() {
  drawn_on_ = status_.screen();
  constexpr std::size_t rows_of_events = 6;
  const std::size_t rows = drawn_on_.rows;
  const std::size_t most = rows > 2 * rows_of_events ? rows - rows_of_events : (rows + 1) / 2;
  status_.show(board_->lines(most, drawn_on_.columns, context_->io.color));
}

/// Under the stream, where both are one terminal.
void WatchStream::show_status() {
  const bool alone = context_->user.frames == Frames::hidden;
  if (!context_->io.out_is_terminal || !alone) return;
  out_.flush();
  if (board_) return show_board();
  status_.show(fmt::format("{} of {} connected, {}, {} NG", connected_, counted(tools_, "tool"),
                           counted(counts_.ok + counts_.ng, "result"), counts_.ng));
}

/// Wakes the other tools' threads too; each still says its farewell.
void WatchStream::end() {
  if (!ended_) context_->end_waits();
  ended_ = true;
}

/// A signal came, and the reader does not take what there is to tell.
Result<Outcome> WatchStream::give_up(std::size_t left) {
  outcome_.fail(context_->interrupt.error());
  if (!context_->io.err_is_ready || context_->io.err_is_ready()) {
    context_->renderer.note(
        fmt::format("{} could not be written: no reader took them from standard output",
                    counted(left, "record")));
  }
  return outcome_;
}

std::string WatchStream::sentence() const {
  std::string text = counted(counts_.events, "event");
  if (counts_.caught_up > 0) text += fmt::format(" ({} caught up)", counts_.caught_up);
  text += fmt::format(", {} OK, {} NG, {}, ", counts_.ok, counts_.ng,
                      counted(counts_.changes, "change"));
  if (counts_.samples > 0) text += counted(counts_.samples, "sample") + ", ";
  if (counts_.remembered > 0) text += fmt::format("{} of unknown age, ", counts_.remembered);
  text += fmt::format("{}, {}", counted(counts_.gaps, "gap"), counted(counts_.losses, "reconnect"));
  if (counts_.missed_intervals > 0)
    text += ", " + counted(counts_.missed_intervals, "interval") + " missed";
  return text;
}

Result<void> WatchStream::summarise() {
  return context_->renderer.summary(
      summary_record({{"events", count(counts_.events)},
                      {"ok", count(counts_.ok)},
                      {"ng", count(counts_.ng)},
                      {"caught_up", count(counts_.caught_up)},
                      {"remembered", count(counts_.remembered)},
                      {"changes", count(counts_.changes)},
                      {"samples", count(counts_.samples)},
                      {"gaps", count(counts_.gaps)},
                      {"reconnects", count(counts_.losses)},
                      {"missed_intervals", count(counts_.missed_intervals)}},
                     outcome_.status(), {}, context_->clock),
      sentence());
}

}  // namespace spindle::commands
