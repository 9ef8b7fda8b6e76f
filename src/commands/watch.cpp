#include <fmt/format.h>

#include <algorithm>
#include <mutex>
#include <utility>
#include <variant>

#include "event_records.hpp"
#include "listing.hpp"
#include "records.hpp"
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
  Stage(const WatchOptions& options, Tools tools, Context& context)
      : options_(&options),
        context_(&context),
        listing_(context, news_columns(tools)),
        started_(context.clock.now()),
        last_event_(started_) {}

  Heed tell(const device::News& news, const NewsRecords& records) {
    const std::lock_guard lock(mutex_);
    if (ended_) return Heed::stop;
    listing_.add(std::visit([&](const auto& one) { return record_of(one, records); }, news));
    const bool counted = options_->count > 0 && events_ + changes_ >= options_->count;
    if (counted || !listing_.open()) end();
    return ended_ ? Heed::stop : Heed::go_on;
  }

  void fail(const Error& error) {
    const std::lock_guard lock(mutex_);
    if (ended_) return;  // an interrupt that we caused ourselves
    outcome_.fail(error);
    const bool asked_to_end = error.code == Errc::interrupted || error.code == Errc::terminated;
    if (!asked_to_end) listing_.add(error);
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
    if (closed_) return tl::unexpected(Error{.code = Errc::closed_pipe});
    if (auto ended = listing_.end(); !ended) return tl::unexpected(std::move(ended.error()));
    const bool idle =
        options_->idle_timeout && context_->clock.now() >= last_event_ + *options_->idle_timeout;
    if (outcome_.failed() == 0) outcome_.succeed();
    if (idle && events_ + changes_ == 0) outcome_.negate();
    return summarise().map([&] { return outcome_; });
  }

 private:
  report::Record record_of(const device::EventNews& news, const NewsRecords& records) {
    report::Record record = records.event(news);
    const std::string kind = records.kind_of(news.block);
    ++events_;
    if (kind == "fastening-ok") ++ok_;
    if (kind == "fastening-ng") ++ng_;
    last_event_ = context_->clock.now();
    return record;
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
    if (news.state == device::LinkState::lost) ++losses_;
    return records.link(news, context_->clock.wall());
  }

  /// Wakes the other tools' threads too; each still says its farewell.
  void end() {
    if (!ended_) context_->end_waits();
    ended_ = true;
  }

  Result<void> summarise() {
    const auto count = [](std::size_t number_of) {
      return number(static_cast<std::int64_t>(number_of));
    };
    return context_->renderer.summary(
        summary_record({{"events", count(events_)},
                        {"ok", count(ok_)},
                        {"ng", count(ng_)},
                        {"changes", count(changes_)},
                        {"gaps", count(gaps_)},
                        {"reconnects", count(losses_)}},
                       outcome_.status(), {}, context_->clock),
        fmt::format("{} events, {} OK, {} NG, {} changes, {} gaps, {} reconnects", events_, ok_,
                    ng_, changes_, gaps_, losses_));
  }

  const WatchOptions* options_;
  Context* context_;
  std::mutex mutex_;
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
  bool ended_ = false;
  bool closed_ = false;
};

Result<device::WatchPlan> plan_of(const WatchOptions& options, const catalogue::Profile& profile) {
  device::WatchPlan plan{.events = options.events,
                         .interval = options.interval,
                         .samples = options.samples,
                         .reconnection = options.reconnection};
  if (!profile.events) plan.events = device::EventMode::none;
  if (!options.names.empty()) {
    auto values = profile.select(options.names);
    if (!values) return tl::unexpected(std::move(values.error()));
    plan.values = std::move(*values);
  }
  if (plan.events == device::EventMode::none && plan.values.empty()) {
    return tl::unexpected(Error{.code = Errc::usage,
                                .message = "this tool sends no events, so name what to watch",
                                .hint = "such as 'status.*'",
                                .name = profile.id});
  }
  return plan;
}

Result<void> watch_one(const WatchedTool& tool, Stage& stage, const WatchOptions& options,
                       const Context& context) {
  auto plan = plan_of(options, *tool.profile);
  if (!plan) return tl::unexpected(std::move(plan.error()));
  const NewsRecords records(tool.target, *tool.profile, *tool.errors);
  device::Watcher watcher(link_opener(tool, context), *tool.profile, std::move(*plan),
                          context.clock,
                          [&](const device::News& news) { return stage.tell(news, records); });
  return watcher.run([&] { return stage.until(); });
}

}  // namespace

Result<Outcome> watch(const WatchOptions& options, Context& context) {
  auto tools = prepare_tools(options.targets, context);
  if (!tools) return tl::unexpected(std::move(tools.error()));
  for (const WatchedTool& tool : tools->tools) {
    if (auto plan = plan_of(options, *tool.profile); !plan) {
      return tl::unexpected(std::move(plan.error()));
    }
  }
  Stage stage(options, tools->tools.size() == 1 ? Tools::one : Tools::several, context);
  for_each_side_by_side(tools->tools, [&](const WatchedTool& tool) {
    auto watched = watch_one(tool, stage, options, context);
    if (!watched) stage.fail(watched.error());
  });
  return stage.finish();
}

}  // namespace spindle::commands
