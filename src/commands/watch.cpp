#include <fmt/format.h>

#include <algorithm>
#include <mutex>
#include <optional>
#include <set>
#include <utility>
#include <variant>

#include "event_records.hpp"
#include "listing.hpp"
#include "motor_records.hpp"
#include "patient_out.hpp"
#include "progress.hpp"
#include "records.hpp"
#include "spindle/base/text.hpp"
#include "spindle/commands/commands.hpp"
#include "spindle/device/run_model.hpp"
#include "spindle/work/connect.hpp"
#include "spindle/work/shared_lines.hpp"
#include "watched_tool.hpp"

namespace spindle::commands {
namespace {

using device::Heed;

/// What was not told of one tool, because nobody took what was told before.
struct Dropped {
  std::size_t records = 0;
  std::optional<std::uint32_t> events = 0;  ///< among them, and in gaps; empty: unknown
};

/// What one tool tells, and how.
struct Voice {
  std::optional<NewsRecords> records = std::nullopt;
  Dropped dropped = {};
};

/// What all tools of one watch share: the stream of records, its counts, and when it ends. The only
/// thing that several threads touch.
class Stage {
 public:
  Stage(const WatchOptions& options, std::size_t tools, const std::vector<report::Column>& columns,
        Context& context)
      : options_(&options),
        context_(&context),
        tools_(tools),
        status_(context),
        out_(context.io, context.interrupt),
        listing_(context, columns),
        started_(context.clock.now()),
        last_event_(started_) {}

  Heed tell(const device::News& news, Voice& voice) {
    const std::lock_guard lock(mutex_);
    if (ended_) return Heed::stop;
    if (out_.is_full()) {
      drop(news, voice.dropped);
      return Heed::go_on;
    }
    status_.clear();
    tell_dropped(voice);
    listing_.add(std::visit([&](const auto& one) { return record_of(one, *voice.records); }, news));
    show_status();
    const bool counted = options_->count > 0 && heard_ >= options_->count;
    if (counted || !listing_.open()) end();
    return ended_ ? Heed::stop : Heed::go_on;
  }

  /// How the watch of one tool ended. `unreached` says why there never was a link to it.
  void leave(const Result<void>& watched, const std::optional<Error>& unreached, Voice& voice) {
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

  /// When to end, as far as is known now.
  TimePoint until() {
    const std::lock_guard lock(mutex_);
    if (context_->io.out_is_open && !context_->io.out_is_open()) {
      closed_ = true;
      end();
    }
    if (ended_) return TimePoint::min();
    TimePoint until = TimePoint::max();
    if (options_->duration) until = started_ + *options_->duration;
    if (options_->idle_timeout) until = std::min(until, last_event_ + *options_->idle_timeout);
    return until;
  }

  Result<Outcome> finish() {
    status_.clear();
    if (closed_) return tl::unexpected(Error{.code = Errc::closed_pipe});
    if (auto ended = listing_.end(); !ended) return tl::unexpected(std::move(ended.error()));
    const bool idle =
        options_->idle_timeout && context_->clock.now() >= last_event_ + *options_->idle_timeout;
    if (idle && heard_ == 0) outcome_.negate();
    const auto left = out_.drain();
    if (!left) return tl::unexpected(left.error());
    if (*left > 0) return give_up(*left);
    if (auto told = summarise(); !told) return tl::unexpected(std::move(told.error()));
    return out_.drain().map([&](std::size_t) { return outcome_; });
  }

 private:
  report::Record record_of(const device::EventNews& news, const NewsRecords& records) {
    report::Record record = records.event(news);
    if (news.standing == device::Standing::remembered) {
      ++remembered_;
      return record;
    }
    if (news.source == device::EventOrigin::catch_up) ++caught_up_;
    const catalogue::EventKind kind = records.kind_of(news.block);
    ++events_;
    if (kind == catalogue::EventKind::fastening_ok) ++ok_;
    if (kind == catalogue::EventKind::fastening_ng) ++ng_;
    hear();
    return record;
  }
  report::Record record_of(const device::MotorNews& news, const NewsRecords& records) {
    ++events_;
    hear();
    return records.motor(news);
  }
  report::Record record_of(const device::ValueNews& news, const NewsRecords& records) {
    const bool sample = options_->samples == device::Samples::all;
    ++(sample ? samples_ : changes_);
    hear();
    return records.value(news, sample ? "sample" : "change", context_->clock.wall());
  }
  report::Record record_of(const device::GapNews& news, const NewsRecords& records) {
    ++gaps_;
    return records.gap(news, context_->clock.wall());
  }
  report::Record record_of(const device::LagNews& news, const NewsRecords& records) {
    missed_intervals_ += news.missed;
    return records.lag(news, context_->clock.wall());
  }
  report::Record record_of(const device::LinkNews& news, const NewsRecords& records) {
    note_link(news);
    return records.link(news, context_->clock.wall());
  }

  void note_link(const device::LinkNews& news) {
    if (news.state == device::LinkState::lost) {
      ++losses_;
      --connected_;
    }
    if (news.state == device::LinkState::connected) ++connected_;
  }

  /// Something came, as --count and --idle-timeout mean it.
  void hear() {
    ++heard_;
    last_event_ = context_->clock.now();
  }

  void drop(const device::News& news, Dropped& dropped) {
    ++dropped.records;
    if (const auto* link = std::get_if<device::LinkNews>(&news)) note_link(*link);
    std::optional<std::uint32_t> events = 0;
    if (std::holds_alternative<device::EventNews>(news) ||
        std::holds_alternative<device::MotorNews>(news)) {
      events = 1;
    }
    if (const auto* gap = std::get_if<device::GapNews>(&news)) events = gap->missed;
    if (!events) dropped.events.reset();
    if (dropped.events) *dropped.events += *events;
  }

  /// In the place of what was not told.
  void tell_dropped(Voice& voice) {
    if (voice.dropped.records == 0) return;
    const Dropped dropped = std::exchange(voice.dropped, {});
    ++gaps_;
    report::Record record = voice.records->gap(
        {dropped.events, fmt::format("{} not told, because nobody took what was told before",
                                     counted(dropped.records, "record"))},
        context_->clock.wall());
    record.fields.push_back({"dropped", count(dropped.records)});
    listing_.add(record);
  }

  /// Under the stream, where both are one terminal.
  void show_status() {
    const bool alone = context_->user.verbosity == Verbosity::normal;
    if (!context_->io.out_is_terminal || !alone) return;
    out_.settle();
    status_.show(fmt::format("{} of {} connected, {}, {} NG", connected_, counted(tools_, "tool"),
                             counted(ok_ + ng_, "result"), ng_));
  }

  /// Wakes the other tools' threads too; each still says its farewell.
  void end() {
    if (!ended_) context_->end_waits();
    ended_ = true;
  }

  /// A signal came, and nobody takes what there is to tell.
  Result<Outcome> give_up(std::size_t left) {
    outcome_.fail(context_->interrupt.error());
    if (!context_->io.err_is_ready || context_->io.err_is_ready()) {
      context_->renderer.note(
          fmt::format("{} could not be written: nobody took them from standard output",
                      counted(left, "record")));
    }
    return outcome_;
  }

  [[nodiscard]] std::string sentence() const {
    std::string text = counted(events_, "event");
    if (caught_up_ > 0) text += fmt::format(" ({} caught up)", caught_up_);
    text += fmt::format(", {} OK, {} NG, {}, ", ok_, ng_, counted(changes_, "change"));
    if (samples_ > 0) text += counted(samples_, "sample") + ", ";
    if (remembered_ > 0) text += fmt::format("{} remembered by a restarted tool, ", remembered_);
    text += fmt::format("{}, {}", counted(gaps_, "gap"), counted(losses_, "reconnect"));
    if (missed_intervals_ > 0) text += ", " + counted(missed_intervals_, "interval") + " missed";
    return text;
  }

  Result<void> summarise() {
    return context_->renderer.summary(
        summary_record({{"events", count(events_)},
                        {"ok", count(ok_)},
                        {"ng", count(ng_)},
                        {"caught_up", count(caught_up_)},
                        {"remembered", count(remembered_)},
                        {"changes", count(changes_)},
                        {"samples", count(samples_)},
                        {"gaps", count(gaps_)},
                        {"reconnects", count(losses_)},
                        {"missed_intervals", count(missed_intervals_)}},
                       outcome_.status(), {}, context_->clock),
        sentence());
  }

  const WatchOptions* options_;
  Context* context_;
  std::size_t tools_;
  std::mutex mutex_;
  ProgressLine status_;
  PatientOut out_;
  Listing listing_;
  Outcome outcome_ = {};
  TimePoint started_;
  TimePoint last_event_;
  std::size_t heard_ = 0;
  std::size_t events_ = 0;
  std::size_t ok_ = 0;
  std::size_t ng_ = 0;
  std::size_t caught_up_ = 0;
  std::size_t remembered_ = 0;
  std::size_t changes_ = 0;
  std::size_t samples_ = 0;
  std::size_t gaps_ = 0;
  std::size_t losses_ = 0;
  std::size_t missed_intervals_ = 0;
  std::size_t connected_ = 0;
  bool ended_ = false;
  bool closed_ = false;
};

/// Whether there is something to watch, and something to poll where it is said how.
Result<device::WatchPlan> check_purpose(const WatchOptions& options,
                                        const catalogue::Profile& profile, device::WatchPlan plan) {
  const bool polls_values = plan.motor || !plan.values.empty();
  if (plan.events == device::EventMode::none && !polls_values) {
    return tl::unexpected(Error{.code = Errc::usage,
                                .message = "this tool sends no events, so name what to watch",
                                .hint = "such as 'status.*'",
                                .name = profile.id});
  }
  const bool polls_events =
      plan.events != device::EventMode::none &&
      (plan.events == device::EventMode::unarmed || !catalogue::sends_unasked(profile));
  const bool says_how = options.interval || options.samples != device::Samples::changes;
  if (says_how && !polls_values && !polls_events) {
    return tl::unexpected(
        Error{.code = Errc::usage,
              .message = "--all, --initial and --interval are about polled values",
              .hint = "name some behind the tool, such as 'status.*'"});
  }
  return plan;
}

/// Why the counter alone can not be polled instead; empty: it can.
std::string_view why_not_unarmed(const catalogue::Profile& profile) {
  if (!profile.events) return "it has no events";
  if (!catalogue::sends_unasked(profile)) return "its events are polled, it sends nothing unasked";
  return profile.events->arm ? "" : "it sends its events whether they are wanted or not";
}

/// The usual pace is that of the profile, or ours.
Result<device::WatchPlan> plan_of(const WatchOptions& options, const catalogue::Profile& profile) {
  device::WatchPlan plan{.events = options.events, .samples = options.samples};
  if (profile.events && profile.events->interval) plan.interval = *profile.events->interval;
  plan.interval = options.interval.value_or(plan.interval);
  if (options.events == device::EventMode::unarmed) {
    if (const auto why = why_not_unarmed(profile); !why.empty()) {
      return tl::unexpected(Error{.code = Errc::usage,
                                  .message = fmt::format("--no-push does nothing here: {}", why),
                                  .hint = "leave it out",
                                  .name = profile.id});
    }
  }
  if (!profile.events) plan.events = device::EventMode::none;
  const auto model = device::RunModel::of(profile);
  if (model && (*model)->monitor() != nullptr) plan.motor = *(*model)->monitor();
  const std::vector<std::string> names =
      options.names.empty() ? to_strings(profile.watched) : options.names;
  if (!names.empty()) {
    auto values = profile.select(names);
    if (!values) return tl::unexpected(std::move(values.error()));
    plan.values = std::move(*values);
  }
  return check_purpose(options, profile, std::move(plan));
}

/// Whether what was asked for can be watched on some tool that is known.
Result<void> check_for_any_profile(const WatchOptions& options, ProfileShelf& shelf,
                                   const Context& context) {
  Result<void> checked;
  for (const files::ProfileEntry& entry : context.profiles.list()) {
    const auto known = shelf.take(entry.id);
    if (!known) continue;                       // another one's broken file
    if (!(*known)->profile.identity) continue;  // found by nobody, always named
    auto plan = plan_of(options, (*known)->profile);
    if (plan) return {};
    checked = tl::unexpected(std::move(plan.error()));
  }
  if (!checked && checked.error().code == Errc::unknown_name) {
    checked.error().message = "neither a tool, nor a parameter of any profile that is known";
  }
  return checked;
}

/// Refuses what can be known to be wrong before anybody is asked.
Result<void> check(const WatchOptions& options, const WatchedTool& tool, ProfileShelf& shelf,
                   const Context& context) {
  if (tool.known() == nullptr) return check_for_any_profile(options, shelf, context);
  return plan_of(options, tool.known()->profile).map([](const device::WatchPlan&) {});
}

/// What a tool may be of which nothing is known yet.
std::vector<const catalogue::Profile*> candidates(ProfileShelf& shelf, const Context& context) {
  std::vector<const catalogue::Profile*> profiles;
  for (const files::ProfileEntry& entry : context.profiles.list()) {
    const auto known = shelf.take(entry.id);
    if (known && (*known)->profile.identity) profiles.push_back(&(*known)->profile);
  }
  return profiles;
}

/// Motors have other columns than tools that count their results.
std::vector<report::Column> columns_for(const std::vector<WatchedTool>& tools, ProfileShelf& shelf,
                                        const WatchOptions& options, const Context& context) {
  const bool one = tools.size() == 1 && !names_group(options.targets.front());
  const Tools shown = one ? Tools::one : Tools::several;
  const bool motors = std::all_of(tools.begin(), tools.end(), [](const WatchedTool& tool) {
    return tool.known() != nullptr && device::has_motor(tool.known()->profile) &&
           !tool.known()->profile.events;
  });
  if (motors) return motor_columns(shown);
  std::vector<const catalogue::Profile*> profiles;
  for (const WatchedTool& tool : tools) {
    if (tool.known() == nullptr) return news_columns(shown, candidates(shelf, context));
    profiles.push_back(&tool.known()->profile);
  }
  return news_columns(shown, profiles);
}

/// Whether the error is one of the tool or its link that does not say yet whose it is.
bool is_about_tool(const Error& error) {
  switch (error.status()) {
    case ExitStatus::unreachable:
    case ExitStatus::no_answer:
    case ExitStatus::refused:
    case ExitStatus::malformed:
    case ExitStatus::mismatch:
      return error.target.empty();
    default:
      return false;
  }
}

void watch_one(WatchedTool& tool, const device::OpenTransport& open_transport, Stage& stage,
               const WatchOptions& options, const Context& context) {
  const catalogue::Profile unknown;
  Voice voice;
  voice.records.emplace(tool.target(), unknown, catalogue::CodeTables());
  const auto open = [&] {
    const TimePoint until = stage.until();
    const TimePoint now = context.clock.now();
    auto link = tool.open(until > now ? until - now : Duration::zero(), open_transport);
    if (link) voice.records.emplace(tool.target(), tool.known()->profile, tool.known()->tables);
    return link;
  };
  const auto plan = [&](const catalogue::Profile& profile) { return plan_of(options, profile); };
  device::Watcher watcher(open, plan, options.reconnection, context.clock,
                          [&](const device::News& news) { return stage.tell(news, voice); });
  const auto of_tool = [&](Error error) {
    if (is_about_tool(error)) return with_target(std::move(error), tool.target());
    error.asked_of = tool.target().shown;
    return error;
  };
  auto watched = watcher.run([&] { return stage.until(); }).map_error(of_tool);
  auto unreached = watcher.unreached();
  if (unreached) unreached = of_tool(std::move(*unreached));
  stage.leave(watched, unreached, voice);
}

}  // namespace

Result<Outcome> watch(const WatchOptions& options, Context& context) {
  ProfileShelf shelf(context.profiles);
  auto tools = prepare_tools(options.targets, options.names, shelf, context);
  if (!tools) return tl::unexpected(std::move(tools.error()));
  for (const WatchedTool& tool : *tools) {
    if (auto checked = check(options, tool, shelf, context); !checked) {
      checked.error().asked_of = tool.target().shown;
      return tl::unexpected(std::move(checked.error()));
    }
  }
  std::vector<Target> targets;
  for (const WatchedTool& tool : *tools) targets.push_back(tool.target());
  SharedLines lines(targets, context);
  const device::OpenTransport open_transport = lines.opener();
  Stage stage(options, tools->size(), columns_for(*tools, shelf, options, context), context);
  for_each_side_by_side(
      *tools, [&](WatchedTool& tool) { watch_one(tool, open_transport, stage, options, context); });
  return stage.finish();
}

}  // namespace spindle::commands
