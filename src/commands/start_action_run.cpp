#include "start_action_run.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "consent.hpp"
#include "event_records.hpp"
#include "listing.hpp"
#include "records.hpp"
#include "spindle/base/duration.hpp"
#include "spindle/device/run_follower.hpp"
#include "spindle/device/start_action.hpp"
#include "spindle/work/start_action_setup.hpp"

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
std::string settings_in_words(const StartActionPlan& plan) {
  std::vector<std::string> words;
  for (const ActionRequest& request : plan.selections) words.push_back(words_of(request));
  return fmt::format("{}", fmt::join(words, ", "));
}

/// One remote start: what is told of it, and how it ended.
class StartActionRun final : public ToolRun {
 public:
  StartActionRun(const RemoteStartOptions& options, const StartActionPlan& plan, OpenTool& tool,
                 Context& context)
      : ToolRun(tool, context),
        options_(&options),
        plan_(&plan),
        setup_(plan, tool, context, log()) {}

  Result<void> ask() override;
  [[nodiscard]] std::string settings_in_words() const override {
    return commands::settings_in_words(*plan_);
  }

  Result<void> prepare() override {
    records_.emplace(tool().target, *tool().profile,
                     context()
                         .profiles.load_code_tables(tool().profile->path)
                         .value_or(catalogue::CodeTables()));
    follower_.emplace(tool().device, plan_->start, context().clock,
                      [this](const device::ToolEvent& event) { tell(event); });
    return setup_.look().and_then([&] { return setup_.select(); }).and_then([&] {
      return follower_->prepare();
    });
  }

  [[nodiscard]] std::vector<report::Column> columns() const override {
    const catalogue::Profile* const profile = tool().profile.get();
    if (context().user.format == report::Format::csv) return exchange_columns({profile});
    return news_columns({Tools::one, {profile}, {tool().target.torque_unit}});
  }
  [[nodiscard]] work::LoggedChange start_change() const override {
    return {.name = plan_->start.name,
            .register_address = plan_->start.address.value,
            .new_value = Decimal(*plan_->start.value)};
  }
  [[nodiscard]] device::GuardedMotion motion() override { return device::motion_of(plan_->start); }

  void begin() override {
    limits_ = limit_run();
    is_begun_ = true;
  }
  Result<void> follow() override {
    TRY_LET(auto ended, follower_->follow(limits_));
    ended_ = std::move(ended);
    return {};
  }

  void look_back(Result<void>& /*followed*/, const device::StopReport& stop) override {
    event_ = find_result(stop);
    follower_->disarm();
  }
  std::vector<Left> put_back() override { return setup_.put_back(); }
  [[nodiscard]] std::vector<Left> left() const override { return setup_.left(); }

  RunEnd judge(const Result<void>& followed) override {
    std::optional<EventKind> kind;
    if (event_) kind = records_->kind_of(event_->block);
    judge(followed, kind);
    const bool refused = !followed && device::is_refusal(followed.error());
    return {.result = to_text(kind),
            .subject = fmt::format("{}; the tool", words_of(kind)),
            .logged = !kind && refused ? "refused" : to_text(kind)};
  }

 private:
  /// What happens to the tool between its start and its end.
  void tell(const device::ToolEvent& event) {
    const auto& identity = tool().device.identity();
    const Naming naming = {.serial = identity ? identity->serial : std::string()};
    if (is_begun_) output().add(records_->event(event, naming));
  }

  /// The time allowed begins before the start is sent, and its echo is not waited for any longer.
  device::FollowOptions limit_run() {
    device::FollowOptions following;
    following.progress = [this](Duration elapsed) { return go_on(elapsed); };
    if (!options_->limit) return following;
    link::Session& session = tool().device.session();
    session.set_answer_timeout(std::min(session.options().answer_timeout, *options_->limit));
    following.deadline = context().clock.now() + *options_->limit;
    return following;
  }

  Result<void> go_on(Duration elapsed) {
    auto read = output().check_reader();
    if (read) output().show_running(elapsed);
    return read;
  }

  /// The event of the run: the one that ended it, or the one that our stop caused.
  std::optional<device::ToolEvent> find_result(const device::StopReport& stop) {
    if (ended_ && ended_->event) return std::move(ended_->event);
    if (stop.result == device::StopResult::unconfirmed) return std::nullopt;
    auto late = follower_->late_event();
    return late ? std::move(*late) : std::nullopt;
  }

  void judge(const Result<void>& followed, std::optional<EventKind> kind) {
    const bool tightened = kind == EventKind::fastening_ok;
    if (!followed && !(tightened && followed.error().code == Errc::closed_pipe)) {
      output().fail_following(followed.error());
      return;
    }
    if (ended_ && ended_->ending == RunEnding::ignored && !kind) {
      output().fail(
          with_target(Error{.code = Errc::mismatch,
                            .message = "the tool acknowledged the start, but does not run",
                            .hint = "is it locked, or without a battery charge?",
                            .name = plan_->start.name},
                      tool().target));
      return;
    }
    if (ended_ && ended_->ending == RunEnding::ended && !kind) {
      output().fail(with_target(Error{.code = Errc::no_answer,
                                      .message = "the tool ran, but never sent a result",
                                      .hint = "'spindle get' with 'event.*' shows its last event"},
                                tool().target));
      return;
    }
    // Success is a screw that is tight, and nothing else.
    output().outcome().succeed();
    if (!tightened) output().outcome().negate();
  }

  const RemoteStartOptions* options_;
  const StartActionPlan* plan_;
  StartActionSetup setup_;
  std::optional<NewsRecords> records_ = std::nullopt;
  std::optional<device::RunFollower> follower_ = std::nullopt;
  bool is_begun_ = false;
  device::FollowOptions limits_ = {};
  std::optional<device::FollowedRun> ended_ = std::nullopt;  ///< empty: it could not be followed
  std::optional<device::ToolEvent> event_ = std::nullopt;
};

/// Before the tool was asked anything.
std::string start_in_words(const StartActionPlan& plan, const Target& target) {
  const std::string settings = settings_in_words(plan);
  return fmt::format("{}{}start on {}", settings, settings.empty() ? "" : ", ", target.shown);
}

/// What is going to happen, as far as it is known before it does.
Result<std::string> foresee(StartActionSetup& setup, const RemoteStartOptions& options,
                            const Target& target) {
  return setup.look().and_then([&] { return setup.describe(); }).map([&](const std::string& words) {
    const std::string limit =
        options.limit ? fmt::format(", for {} at most", spindle::to_text(*options.limit)) : "";
    return fmt::format("start {}: {}{}: the tool will turn", target.shown, words, limit);
  });
}

/// Asks with what the tool itself says, and makes sure that it is still so behind the answer.
Result<void> StartActionRun::ask() {
  if (context().user.consent == Consent::given) return {};
  TRY_LET(const auto asked, foresee(setup_, *options_, tool().target));
  TRY(ask_away_from(tool(), asked, context()));
  const auto now = foresee(setup_, *options_, tool().target);
  if (!now) return tl::unexpected(now.error());
  if (*now == asked) return {};
  return tl::unexpected(
      not_ready(tool().target,
                fmt::format("the tool was changed while the question stood; now it is: {}", *now),
                "nothing was done; start it again"));
}

class Plan final : public RunPlan {
 public:
  Plan(const RemoteStartOptions& options, StartActionPlan plan)
      : options_(options), plan_(std::move(plan)) {}

  [[nodiscard]] std::string in_words(const Target& target) const override {
    return start_in_words(plan_, target);
  }
  [[nodiscard]] std::unique_ptr<ToolRun> on(OpenTool& tool, Context& context) const override {
    return std::make_unique<StartActionRun>(options_, plan_, tool, context);
  }

 private:
  RemoteStartOptions options_;
  StartActionPlan plan_;
};

/// What was typed behind an option of the profile.
const std::string& value_of(std::string_view option, const RemoteStartOptions& options) {
  return option == "preset" ? options.preset : options.direction;
}

}  // namespace

Result<std::unique_ptr<RunPlan>> plan_start_action(const RemoteStartOptions& options,
                                                   const Profile& profile, const Target& target) {
  TRY_LET(const auto model, device::StartAction::of(profile));
  if (profile.events && !profile.events->first) {
    return tl::unexpected(
        Error{.code = Errc::usage,
              .message = "where its last event can be read is not known, so the result of a run "
                         "cannot be told from an older one",
              .hint = "start it at the tool, and watch it with 'spindle watch'",
              .name = profile.id});
  }
  if (!profile.events || model.start().confirm.empty()) {
    return tl::unexpected(Error{.code = Errc::usage,
                                .message = "a run of this product cannot be followed",
                                .hint = "its profile lacks 'events', or 'confirm' of its start",
                                .name = profile.id});
  }
  StartActionPlan plan{.facts = model.facts(), .selections = {}, .start = model.start()};
  for (const catalogue::StartOption& option : plan.facts.selections) {
    const std::string& value = value_of(option.option, options);
    if (value.empty()) continue;
    TRY_LET(auto request, parse_action(fmt::format("{}={}", option.action, value), profile));
    auto allowed = check_evidence(request.action, target, options.acceptance);
    if (!allowed) return tl::unexpected(std::move(allowed.error()));
    plan.selections.push_back(std::move(request));
  }
  return check_evidence(plan.start, target, options.acceptance)
      .map([&]() -> std::unique_ptr<RunPlan> {
        return std::make_unique<Plan>(options, std::move(plan));
      });
}

}  // namespace spindle::commands
