#include "run_tool.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "change_log.hpp"
#include "consent.hpp"
#include "event_records.hpp"
#include "guarded_run.hpp"
#include "listing.hpp"
#include "records.hpp"
#include "spindle/base/duration.hpp"
#include "spindle/device/run_follower.hpp"
#include "spindle/device/run_guard.hpp"
#include "tool_setup.hpp"

namespace spindle::commands {
namespace {

using catalogue::EventKind;
using catalogue::Profile;
using device::RunEnding;

/// A result in the words of the table.
std::string_view words_of(std::optional<EventKind> kind) {
  if (kind == EventKind::fastening_ok) return "OK";
  if (kind == EventKind::fastening_ng) return "NG";
  if (kind == EventKind::error) return "error";
  return kind ? "ended without OK or NG" : "no result";
}

std::string to_text(std::optional<EventKind> kind) {
  return kind ? std::string(catalogue::to_text(*kind)) : std::string();
}

/// "select-preset=2, direction=loosening"; empty when nothing is selected.
std::string settings_in_words(const ToolPlan& plan) {
  std::vector<std::string> words;
  for (const ActionRequest& request : plan.selections) words.push_back(words_of(request));
  return fmt::format("{}", fmt::join(words, ", "));
}

/// One remote start: what is told of it, and how it ended.
class RemoteRun {
 public:
  RemoteRun(const RemoteStartOptions& options, const ToolPlan& plan, OpenTool& tool,
            Context& context)
      : options_(&options),
        plan_(&plan),
        tool_(&tool),
        context_(&context),
        guarded_(tool, context),
        log_(change_log("remote-start", tool, context)),
        setup_(plan, tool, context, log_),
        records_(tool.target, *tool.profile,
                 context.profiles.load_code_tables(tool.profile->path)
                     .value_or(catalogue::CodeTables())) {}

  Result<Outcome> run() {
    if (auto guarded = guarded_.set_guardian(settings_in_words(*plan_)); !guarded) {
      return tl::unexpected(std::move(guarded.error()));
    }
    device::RunFollower follower(tool_->device, plan_->start, context_->clock,
                                 [this](const device::EventNews& event) { tell(event); });
    auto ready = setup_.look().and_then([&] { return setup_.select(); }).and_then([&] {
      return follower.prepare();
    });
    if (!ready) return tl::unexpected(with_left(std::move(ready.error()), setup_.put_back()));
    listing_.emplace(*context_, news_columns(Tools::one));
    started_ = log_.begin(start_record({}));
    auto [followed, stop] = guarded_.run(
        device::motion_of(plan_->start), [this] { return limit_run(); },
        [&](const device::FollowOptions& limits) { return follower.follow(limits); });
    auto event = find_result(followed, follower, stop);
    follower.leave();
    const bool stands = stop.result != device::StopResult::unconfirmed;
    guarded_.leave(stands ? setup_.put_back() : setup_.left());
    return report(followed, event, stop);
  }

 private:
  /// What happens to the tool between its start and its end.
  void tell(const device::EventNews& event) {
    if (listing_) listing_->add(records_.event(event));
  }

  /// The time allowed begins before the start is sent, and its echo is not waited for any longer.
  device::FollowOptions limit_run() {
    device::FollowOptions following;
    following.progress = [this](Duration elapsed) { return go_on(elapsed); };
    if (!options_->limit) return following;
    link::Session& session = tool_->device.session();
    session.set_answer_timeout(std::min(session.options().answer_timeout, *options_->limit));
    following.deadline = context_->clock.now() + *options_->limit;
    return following;
  }

  Result<void> go_on(Duration elapsed) {
    auto read = guarded_.check_reader();
    if (read) guarded_.show_running(elapsed);
    return read;
  }

  /// The event of the run: the one that ended it, or the one that our stop caused.
  std::optional<device::EventNews> find_result(Result<device::FollowedRun>& followed,
                                               device::RunFollower& follower,
                                               const device::StopReport& stop) {
    if (followed && followed->event) return std::move(followed->event);
    if (stop.result == device::StopResult::unconfirmed) return std::nullopt;
    auto late = follower.late_event();
    return late ? std::move(*late) : std::nullopt;
  }

  Result<Outcome> report(const Result<device::FollowedRun>& followed,
                         const std::optional<device::EventNews>& event,
                         const device::StopReport& stop) {
    std::optional<EventKind> kind;
    if (event) kind = records_.kind_of(event->block);
    log_run(followed, kind, stop);
    judge(followed, kind);
    return guarded_.end(
        *listing_, stop,
        {.result = to_text(kind), .subject = fmt::format("{}; the tool", words_of(kind))});
  }

  void log_run(const Result<device::FollowedRun>& followed, std::optional<EventKind> kind,
               const device::StopReport& stop) {
    const bool refused = !followed && device::is_refusal(followed.error());
    const std::string result = !kind && refused ? "refused" : to_text(kind);
    log_.end(started_, start_record(log_word(result, stop)));
  }

  [[nodiscard]] work::LoggedChange start_record(std::string result) const {
    return {.name = plan_->start.name,
            .register_address = plan_->start.address.value,
            .new_value = Decimal(*plan_->start.value),
            .result = std::move(result)};
  }

  void judge(const Result<device::FollowedRun>& followed, std::optional<EventKind> kind) {
    const bool tightened = kind == EventKind::fastening_ok;
    if (!followed && !(tightened && followed.error().code == Errc::closed_pipe)) {
      guarded_.fail_following(followed.error());
      return;
    }
    if (followed && followed->ending == RunEnding::ignored && !kind) {
      guarded_.fail(
          tool_->target.blamed({.code = Errc::mismatch,
                                .message = "the tool acknowledged the start, but does not run",
                                .hint = "is it locked, or without a battery charge?",
                                .name = plan_->start.name}));
      return;
    }
    if (followed && followed->ending == RunEnding::ended && !kind) {
      guarded_.fail(
          tool_->target.blamed({.code = Errc::no_answer,
                                .message = "the tool ran, but never sent a result",
                                .hint = "'spindle get' with 'event.*' shows its last event"}));
      return;
    }
    // Success is a screw that is tight, and nothing else.
    guarded_.outcome().succeed();
    if (!tightened) guarded_.outcome().negate();
  }

  const RemoteStartOptions* options_;
  const ToolPlan* plan_;
  OpenTool* tool_;
  Context* context_;
  GuardedRun guarded_;
  work::ChangeLog log_;
  std::string started_ = {};  ///< the record that the start was begun
  ToolSetup setup_;
  NewsRecords records_;
  std::optional<Listing> listing_ = std::nullopt;  ///< from just before the start
};

/// Before the tool was asked anything.
std::string start_in_words(const ToolPlan& plan, const Target& target) {
  const std::string settings = settings_in_words(plan);
  return fmt::format("{}{}start on {}", settings, settings.empty() ? "" : ", ", target.shown);
}

/// What is going to happen, as far as it is known before it does.
Result<std::string> foresee(const ToolPlan& plan, const RemoteStartOptions& options, OpenTool& tool,
                            Context& context) {
  work::ChangeLog log = change_log("remote-start", tool, context);
  ToolSetup setup(plan, tool, context, log);
  return setup.look().and_then([&] { return setup.describe(); }).map([&](const std::string& words) {
    const std::string limit =
        options.limit ? fmt::format(", for {} at most", spindle::to_text(*options.limit)) : "";
    return fmt::format("start {}: {}{}: the tool will turn", tool.target.shown, words, limit);
  });
}

/// Asks with what the tool itself says, and makes sure that it is still so behind the answer.
Result<void> ask_to_start(const ToolPlan& plan, const RemoteStartOptions& options, OpenTool& tool,
                          Context& context) {
  if (context.user.consent == Consent::given) return {};
  const auto asked = foresee(plan, options, tool, context);
  if (!asked) return tl::unexpected(asked.error());
  if (auto agreed = ask_away_from(tool, *asked, context); !agreed) return agreed;
  const auto now = foresee(plan, options, tool, context);
  if (!now) return tl::unexpected(now.error());
  if (*now == *asked) return {};
  return tl::unexpected(
      not_ready(tool.target,
                fmt::format("the tool was changed while the question stood; now it is: {}", *now),
                "nothing was done; start it again"));
}

}  // namespace

Result<Outcome> run_tool(const RemoteStartOptions& options, const Target& target,
                         Context& context) {
  auto opened = open_prepared(target, Need::named_registers, context, [&](const Profile& profile) {
    return plan_tool(options, profile, target).and_then([&](ToolPlan plan) {
      return require_answer(start_in_words(plan, target), context).map([&] {
        return std::move(plan);
      });
    });
  });
  if (!opened) return tl::unexpected(std::move(opened.error()));
  auto& [tool, plan] = *opened;
  if (auto agreed = ask_to_start(plan, options, tool, context); !agreed) {
    return tl::unexpected(std::move(agreed.error()));
  }
  return RemoteRun(options, plan, tool, context).run();
}

}  // namespace spindle::commands
