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
#include "progress.hpp"
#include "records.hpp"
#include "shared_lines.hpp"
#include "spindle/base/text.hpp"
#include "spindle/commands/commands.hpp"
#include "spindle/commands/target.hpp"
#include "watched_tool.hpp"

namespace spindle::commands {
namespace {

using device::Heed;

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
        listing_(context, columns),
        started_(context.clock.now()),
        last_event_(started_) {}

  Heed tell(const device::News& news, const NewsRecords& records) {
    const std::lock_guard lock(mutex_);
    if (ended_) return Heed::stop;
    status_.clear();
    listing_.add(std::visit([&](const auto& one) { return record_of(one, records); }, news));
    show_status();
    const bool counted = options_->count > 0 && events_ + changes_ >= options_->count;
    if (counted || !listing_.open()) end();
    return ended_ ? Heed::stop : Heed::go_on;
  }

  /// How the watch of one tool ended.
  void leave(const Result<void>& watched) {
    const std::lock_guard lock(mutex_);
    if (watched || ended_) {  // once the whole ends, it is we who interrupt the others
      outcome_.succeed();
      return;
    }
    outcome_.fail(watched.error());
    const ExitStatus status = watched.error().status();
    const bool asked_to_end = status == ExitStatus::interrupted || status == ExitStatus::terminated;
    status_.clear();
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
    if (idle && events_ + changes_ == 0) outcome_.negate();
    return summarise().map([&] { return outcome_; });
  }

 private:
  report::Record record_of(const device::EventNews& news, const NewsRecords& records) {
    report::Record record = records.event(news);
    const catalogue::EventKind kind = records.kind_of(news.block);
    ++events_;
    if (kind == catalogue::EventKind::fastening_ok) ++ok_;
    if (kind == catalogue::EventKind::fastening_ng) ++ng_;
    last_event_ = context_->clock.now();
    return record;
  }
  report::Record record_of(const device::MotorNews& news, const NewsRecords& records) {
    ++events_;
    last_event_ = context_->clock.now();
    return records.motor(news);
  }
  report::Record record_of(const device::ValueNews& news, const NewsRecords& records) {
    ++changes_;
    last_event_ = context_->clock.now();
    return records.change(news, context_->clock.wall());
  }
  report::Record record_of(const device::GapNews& news, const NewsRecords& records) {
    ++gaps_;
    return records.gap(news, context_->clock.wall());
  }
  report::Record record_of(const device::LinkNews& news, const NewsRecords& records) {
    if (news.state == device::LinkState::lost) {
      ++losses_;
      --connected_;
    }
    if (news.state == device::LinkState::connected) ++connected_;
    return records.link(news, context_->clock.wall());
  }

  /// Under the stream, where both are one terminal.
  void show_status() {
    const bool alone = context_->common.verbosity == Verbosity::normal;
    if (!context_->io.out_is_terminal || !alone) return;
    status_.show(fmt::format("{} of {} connected, {}, {} NG", connected_, counted(tools_, "tool"),
                             counted(ok_ + ng_, "result"), ng_));
  }

  /// Wakes the other tools' threads too; each still says its farewell.
  void end() {
    if (!ended_) context_->end_waits();
    ended_ = true;
  }

  Result<void> summarise() {
    return context_->renderer.summary(
        summary_record({{"events", count(events_)},
                        {"ok", count(ok_)},
                        {"ng", count(ng_)},
                        {"changes", count(changes_)},
                        {"gaps", count(gaps_)},
                        {"reconnects", count(losses_)}},
                       outcome_.status(), {}, context_->clock),
        fmt::format("{}, {} OK, {} NG, {}, {}, {}", counted(events_, "event"), ok_, ng_,
                    counted(changes_, "change"), counted(gaps_, "gap"),
                    counted(losses_, "reconnect")));
  }

  const WatchOptions* options_;
  Context* context_;
  std::size_t tools_;
  std::mutex mutex_;
  ProgressLine status_;
  Listing listing_;
  Outcome outcome_ = {};
  TimePoint started_;
  TimePoint last_event_;
  std::size_t events_ = 0;
  std::size_t ok_ = 0;
  std::size_t ng_ = 0;
  std::size_t changes_ = 0;
  std::size_t gaps_ = 0;
  std::size_t losses_ = 0;
  std::size_t connected_ = 0;
  bool ended_ = false;
  bool closed_ = false;
};

Result<device::WatchPlan> plan_of(const WatchOptions& options, const catalogue::Profile& profile) {
  device::WatchPlan plan{.events = options.events, .samples = options.samples};
  plan.interval = options.interval.value_or(plan.interval);
  if (!profile.events) plan.events = device::EventMode::none;
  if (profile.run) {
    auto motor = device::Motor::of(profile);
    if (!motor) return tl::unexpected(std::move(motor.error()));
    plan.motor = std::move(*motor);
  }
  const std::vector<std::string>& names = options.names.empty() ? profile.watched : options.names;
  if (!names.empty()) {
    auto values = profile.select(names);
    if (!values) return tl::unexpected(std::move(values.error()));
    plan.values = std::move(*values);
  }
  if (plan.events == device::EventMode::none && !plan.motor && plan.values.empty()) {
    return tl::unexpected(Error{.code = Errc::usage,
                                .message = "this tool sends no events, so name what to watch",
                                .hint = "such as 'status.*'",
                                .name = profile.id});
  }
  const bool polls = plan.events == device::EventMode::poll || plan.motor || !plan.values.empty();
  const bool says_how = options.interval || options.samples != device::Samples::changes;
  if (says_how && !polls) {
    return tl::unexpected(
        Error{.code = Errc::usage,
              .message = "--all, --initial and --interval are about polled values",
              .hint = "name some behind the tool, such as 'status.*'"});
  }
  return plan;
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

/// Motors have other columns than tools that count their results.
std::vector<report::Column> columns_for(const std::vector<WatchedTool>& tools,
                                        const WatchOptions& options) {
  const bool one = tools.size() == 1 && !names_group(options.targets.front());
  const Tools shown = one ? Tools::one : Tools::several;
  const bool motors = std::all_of(tools.begin(), tools.end(), [](const WatchedTool& tool) {
    return tool.known() != nullptr && tool.known()->profile.run && !tool.known()->profile.events;
  });
  return motors ? motor_columns(shown) : news_columns(shown);
}

Result<void> watch_one(WatchedTool& tool, const device::OpenTransport& open_transport, Stage& stage,
                       const WatchOptions& options, const Context& context) {
  const catalogue::Profile unknown;
  std::optional<NewsRecords> records;
  records.emplace(tool.target(), unknown, catalogue::CodeTables());
  const auto open = [&] {
    const TimePoint until = stage.until();
    const TimePoint now = context.clock.now();
    auto link = tool.open(until > now ? until - now : Duration::zero(), open_transport);
    if (link) records.emplace(tool.target(), tool.known()->profile, tool.known()->tables);
    return link;
  };
  const auto plan = [&](const catalogue::Profile& profile) { return plan_of(options, profile); };
  device::Watcher watcher(open, plan, options.reconnection, context.clock,
                          [&](const device::News& news) { return stage.tell(news, *records); });
  return watcher.run([&] { return stage.until(); });
}

}  // namespace

Result<Outcome> watch(const WatchOptions& options, Context& context) {
  ProfileShelf shelf(context.profiles);
  auto tools = prepare_tools(options.targets, shelf, context);
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
  Stage stage(options, tools->size(), columns_for(*tools, options), context);
  for_each_side_by_side(*tools, [&](WatchedTool& tool) {
    auto watched = watch_one(tool, open_transport, stage, options, context);
    if (!watched) watched.error().asked_of = tool.target().shown;
    stage.leave(watched);
  });
  return stage.finish();
}

}  // namespace spindle::commands
