#include <fmt/format.h>

#include <utility>

#include "change_log.hpp"
#include "deeds.hpp"
#include "event_records.hpp"
#include "guarded_run.hpp"
#include "listing.hpp"
#include "records.hpp"
#include "run_motor.hpp"
#include "spindle/commands/commands.hpp"
#include "spindle/commands/target.hpp"
#include "spindle/device/run_follower.hpp"
#include "spindle/device/run_guard.hpp"
#include "stops.hpp"

namespace spindle::commands {
namespace {

using catalogue::Action;
using catalogue::EventKind;
using catalogue::Profile;
using device::RunEnding;

/// Everything that is decided before the tool is touched.
struct RunPlan {
  std::vector<Deed> selections;  ///< preset and direction, as far as they were given
  Action start;
  Action alarm_reset;  ///< its confirming parameter tells whether there is an alarm
};

Result<RunPlan> plan_run(const RemoteStartOptions& options, const Profile& profile,
                         const Target& target) {
  auto start = find_start(profile);
  if (!start) return tl::unexpected(std::move(start.error()));
  if (!profile.events || start->confirm.empty()) {
    return tl::unexpected(Error{.code = Errc::usage,
                                .message = "a run of this product can not be followed",
                                .hint = "its profile lacks 'events', or 'confirm' of its start",
                                .name = profile.id});
  }
  auto alarm_reset = profile.find_action("alarm-reset");
  if (!alarm_reset) return tl::unexpected(std::move(alarm_reset.error()));
  RunPlan plan{.selections = {}, .start = *start, .alarm_reset = std::move(*alarm_reset)};
  for (const auto& [name, value] :
       {std::pair("select-preset", &options.preset), std::pair("direction", &options.direction)}) {
    if (value->empty()) continue;
    auto deed = parse_deed(fmt::format("{}={}", name, *value), profile);
    if (!deed) return tl::unexpected(std::move(deed.error()));
    auto allowed = check_evidence(deed->action, target, options.acceptance);
    if (!allowed) return tl::unexpected(std::move(allowed.error()));
    plan.selections.push_back(std::move(*deed));
  }
  return check_evidence(plan.start, target, options.acceptance).map([&] {
    return std::move(plan);
  });
}

Result<void> ask_to_start(const RunPlan& plan, const Target& target, const Context& context) {
  std::vector<Deed> deeds = plan.selections;
  deeds.push_back({plan.start, *plan.start.value});
  return ask_for_hazards(deeds, target, context);
}

/// No alarm, not running. Whether it is locked can not be read on every product.
Result<void> check_ready(const RunPlan& plan, OpenTool& tool) {
  const auto alarm_free =
      tool.device.shows(plan.alarm_reset.confirm, plan.alarm_reset.confirm_value.value_or(0));
  if (!alarm_free) return tl::unexpected(alarm_free.error());
  if (*alarm_free == device::Shown::no) {
    return tl::unexpected(not_ready(tool.target, "the tool has an alarm, so it was not started",
                                    "'spindle alarms' shows it"));
  }
  const auto still = tool.device.shows(plan.start.confirm, *plan.start.stop_value);
  if (!still) return tl::unexpected(still.error());
  if (*still == device::Shown::no) {
    return tl::unexpected(
        not_ready(tool.target, "the tool runs already, so it was not started",
                  "wait until it stands still, or stop it with 'spindle remote-stop'"));
  }
  return {};
}

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

/// One remote start: what is told of it, and how it ended.
class RemoteRun {
 public:
  RemoteRun(const RemoteStartOptions& options, const RunPlan& plan, OpenTool& tool,
            Context& context)
      : options_(&options),
        plan_(&plan),
        tool_(&tool),
        context_(&context),
        guarded_(tool, context),
        log_(change_log("remote-start", tool, context)) {}

  Result<Outcome> run() {
    if (auto guarded = guarded_.set_guardian(); !guarded) {
      return tl::unexpected(std::move(guarded.error()));
    }
    auto selected = check_ready(*plan_, *tool_).and_then([&] { return select(); });
    if (!selected) return tl::unexpected(std::move(selected.error()));
    device::RunFollower follower(tool_->device, plan_->start, context_->clock);
    if (auto prepared = follower.prepare(); !prepared) {
      return tl::unexpected(std::move(prepared.error()));
    }
    started_ = log_.begin(start_record({}));
    auto [followed, stop] = guarded_.run(
        device::motion_of(plan_->start), [this] { return limit_run(); },
        [&](const device::FollowOptions& limits) { return follower.follow(limits); });
    auto late = find_result(followed, follower, stop);
    follower.leave();
    return report(followed, late, stop);
  }

 private:
  Result<void> select() {
    for (const Deed& deed : plan_->selections) {
      const auto result = perform_recorded(deed, *tool_, log_, *context_);
      if (!result) return tl::unexpected(result.error());
      if (result == device::ActionResult::not_confirmed) {
        return tl::unexpected(not_confirmed(deed, tool_->target));
      }
    }
    return {};
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
    const auto tables = context_->profiles.load_code_tables(tool_->profile->path);
    const NewsRecords records(tool_->target, *tool_->profile,
                              tables.value_or(catalogue::CodeTables()));
    Listing listing(*context_, news_columns(Tools::one));
    std::optional<EventKind> kind;
    if (event) {
      kind = records.kind_of(event->block);
      listing.add(records.event(*event));
    }
    log_run(followed, kind, stop);
    judge(followed, kind);
    return guarded_.end(
        listing, stop,
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
    if (!followed) {
      guarded_.fail_following(followed.error());
      return;
    }
    if (followed->ending == RunEnding::ignored && !kind) {
      guarded_.fail(
          tool_->target.blamed({.code = Errc::mismatch,
                                .message = "the tool acknowledged the start, but does not run",
                                .hint = "is it locked, or without a battery charge?",
                                .name = plan_->start.name}));
      return;
    }
    if (followed->ending == RunEnding::ended && !kind) {
      guarded_.fail(
          tool_->target.blamed({.code = Errc::no_answer,
                                .message = "the tool ran, but never sent a result",
                                .hint = "'spindle get' with 'event.*' shows its last event"}));
      return;
    }
    guarded_.outcome().succeed();
    if (kind == EventKind::fastening_ng || kind == EventKind::error) guarded_.outcome().negate();
  }

  const RemoteStartOptions* options_;
  const RunPlan* plan_;
  OpenTool* tool_;
  Context* context_;
  GuardedRun guarded_;
  work::ChangeLog log_;
  std::string started_ = {};  ///< the record that the start was begun
};

/// What only motors have is a mistake on a tool that runs by itself.
Result<void> check_tool_options(const RemoteStartOptions& options) {
  const std::pair<std::string_view, bool> given[] = {
      {"--speed", !options.speed.empty()},
      {"--reverse", options.direction_of_motor == catalogue::Direction::reverse},
      {"--operation", options.operation.has_value()},
      {"--acceleration", !options.acceleration.empty()},
      {"--deceleration", !options.deceleration.empty()},
      {"--watchdog", options.watchdog.has_value()},
      {"--stop", options.stop.has_value()}};
  for (const auto& [option, is_given] : given) {
    if (!is_given) continue;
    return tl::unexpected(Error{.code = Errc::usage,
                                .message = "this tool has no motor that is run by speed",
                                .hint = "it takes --preset, --direction and --for",
                                .name = std::string(option)});
  }
  return {};
}

}  // namespace

Result<Outcome> remote_start(const RemoteStartOptions& options, Context& context) {
  const auto target =
      resolve_target(options.target, context,
                     {.why = "a motion is started one tool at a time, by somebody who watches it",
                      .instead = "start them one after the other, beginning with"});
  if (!target) return tl::unexpected(target.error());
  const auto known = load_profile(*target, context);
  if (known && known->run) return run_motor(options, *target, context);
  if (auto fits = check_tool_options(options); !fits) return tl::unexpected(fits.error());
  auto opened = open_prepared(*target, Need::named_registers, context, [&](const Profile& profile) {
    return plan_run(options, profile, *target).and_then([&](RunPlan plan) {
      return ask_to_start(plan, *target, context).map([&] { return std::move(plan); });
    });
  });
  if (!opened) return tl::unexpected(std::move(opened.error()));
  return RemoteRun(options, opened->prepared, opened->tool, context).run();
}

}  // namespace spindle::commands
