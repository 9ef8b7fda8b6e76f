#include "run_motor.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <utility>

#include "change_log.hpp"
#include "consent.hpp"
#include "guarded_run.hpp"
#include "listing.hpp"
#include "motor_records.hpp"
#include "motor_setup.hpp"
#include "spindle/base/duration.hpp"
#include "spindle/device/motor_follower.hpp"

namespace spindle::commands {
namespace {

using catalogue::Direction;
using catalogue::Profile;
using catalogue::RunFacts;
using device::MotorEnding;

/// Between two looks at a running motor; a watchdog that is on is fed more often.
constexpr Duration look_interval = std::chrono::milliseconds(100);
constexpr int looks_per_watchdog = 4;

std::string_view words_of(Direction direction) {
  return direction == Direction::forward ? "forward" : "in reverse";
}

/// "operation.2.speed=500 r/min, communication.timeout=1000 ms".
std::string settings_in_words(const MotorPlan& plan) {
  std::vector<std::string> words;
  const auto add = [&](const catalogue::Parameter& parameter, const catalogue::Value& value) {
    words.push_back(fmt::format("{}={}{}{}", parameter.name, value.to_string(),
                                parameter.unit.empty() ? "" : " ", parameter.unit));
  };
  for (const auto& [parameter, value] : plan.settings) add(parameter, value);
  if (plan.watchdog) add(*plan.watchdog_parameter, *plan.watchdog);
  return fmt::format("{}", fmt::join(words, ", "));
}

/// One run of a motor: what is told of it, and how it ended.
class MotorRun {
 public:
  MotorRun(const RemoteStartOptions& options, const MotorPlan& plan, OpenTool& tool,
           Context& context)
      : options_(&options),
        plan_(&plan),
        tool_(&tool),
        context_(&context),
        guarded_(tool, context),
        log_(change_log("remote-start", tool, context)),
        setup_(plan, tool, context, log_),
        stopper_(plan.motor, options.stop.value_or(catalogue::StopMode::decelerate)),
        tables_(context.profiles.load_code_tables(tool.profile->path)
                    .value_or(catalogue::CodeTables())) {}

  Result<Outcome> run() {
    const auto stop_mode = options_->stop.value_or(catalogue::StopMode::decelerate);
    if (auto guarded = guarded_.set_guardian(settings_in_words(*plan_), stop_mode); !guarded) {
      return tl::unexpected(std::move(guarded.error()));
    }
    if (auto ready = setup_.prepare(); !ready) {
      return tl::unexpected(with_left(std::move(ready.error()), setup_.put_back()));
    }
    const std::uint16_t word = setup_.start_word();
    stopper_.started(setup_.standard_word(), setup_.input_mode(), setup_.bits(), setup_.stopping());
    listing_.emplace(*context_, motor_columns(Tools::one));
    started_ = log_.begin({.name = "start", .new_value = Decimal(word)});
    auto [followed, stop] = guarded_.run(
        motion(word), [this] { return limit_run(); },
        [this](const device::MotorFollowOptions& limits) {
          return device::follow_motor(tool_->device, plan_->motor, stopper_, limits);
        });
    const bool stands = stop.result == device::StopResult::confirmed;
    if (stands) look_back(followed);
    guarded_.leave(stands ? setup_.put_back() : setup_.left());
    return report(followed, stop);
  }

 private:
  [[nodiscard]] const RunFacts& facts() const { return plan_->motor.facts(); }

  device::GuardedMotion motion(std::uint16_t word) {
    return {.start = [this,
                      word](device::Device& device) { return plan_->motor.command(device, word); },
            .stop = [this](device::Device& device,
                           Clock& clock) { return stopper_.stop(device, clock); },
            .stopping = setup_.stopping()};
  }

  device::MotorFollowOptions limit_run() {
    device::MotorFollowOptions following;
    following.fastest = plan_->speed();
    following.interval = look_interval;
    const auto& watchdog = setup_.watchdog();
    if (watchdog && watchdog->number != Decimal(0)) {
      const Duration bites = std::chrono::milliseconds(watchdog->number.mantissa());
      following.interval = std::min(look_interval, bites / looks_per_watchdog);
    }
    following.progress = [this](Duration elapsed, const device::MotorState& state) {
      auto read = guarded_.check_reader();
      if (read) guarded_.show_running(elapsed, fmt::format(", {} r/min", state.feedback_speed));
      return read;
    };
    following.hear = [this](const device::MotorNews& news) { tell(news); };
    if (options_->limit) following.deadline = context_->clock.now() + *options_->limit;
    return following;
  }

  void tell(const device::MotorNews& news) {
    news_.push_back(news);
    listing_->add(motor_record(news, tool_->target, tables_));
  }

  [[nodiscard]] bool has_told(device::MotorEvent event) const {
    return std::any_of(news_.begin(), news_.end(),
                       [&](const device::MotorNews& news) { return news.event == event; });
  }

  /// Behind a confirmed stop. An alarm may have ended the run where nobody looked: by the driver's
  /// own watchdog while this program was kept from asking it.
  void look_back(Result<MotorEnding>& followed) {
    auto state = plan_->motor.look(tool_->device);
    if (!state) state = plan_->motor.look(tool_->device);
    if (!state) {
      if (followed == MotorEnding::elapsed) followed = tl::unexpected(std::move(state.error()));
      state = device::MotorState();
    }
    const WallTime now = context_->clock.wall();
    if (state->alarm != 0) {
      if (!has_told(device::MotorEvent::alarm)) tell({device::MotorEvent::alarm, *state, now});
      if (followed) followed = MotorEnding::alarm;
    }
    if (!news_.empty() && !has_told(device::MotorEvent::stopped)) {
      tell({device::MotorEvent::stopped, *state, now});
    }
  }

  Result<Outcome> report(const Result<MotorEnding>& followed, const device::StopReport& stop) {
    log_run(followed, stop);
    judge(followed);
    const std::string_view result = result_of(followed);
    return guarded_.end(*listing_, stop,
                        {.result = std::string(result),
                         .subject = result == "ran" ? "ran; the motor" : "the motor"});
  }

  void log_run(const Result<MotorEnding>& followed, const device::StopReport& stop) {
    log_.end(started_, {.name = "start",
                        .new_value = Decimal(setup_.start_word()),
                        .result = log_word(result_of(followed), stop)});
  }

  void judge(const Result<MotorEnding>& followed) {
    if (!followed) {
      guarded_.fail_following(followed.error());
      return;
    }
    switch (*followed) {
      case MotorEnding::elapsed:
        guarded_.outcome().succeed();
        return;
      case MotorEnding::alarm:
        guarded_.fail(not_ready(tool_->target, fmt::format("alarm {} ended the run", alarm_words()),
                                "'spindle alarms' shows what helps"));
        return;
      case MotorEnding::stopped:
        guarded_.fail(not_ready(tool_->target,
                                "the motor stopped before its time, and not by this program",
                                "does somebody else command it?"));
        return;
      case MotorEnding::ignored:
        guarded_.fail(tool_->target.blamed(
            {.code = Errc::mismatch,
             .message = "the driver acknowledged the start, but the motor does not run",
             .hint = fmt::format("does {} wait for 'do configure'? is the main power on?",
                                 facts().mode)}));
        return;
      case MotorEnding::too_fast:
        guarded_.fail(tool_->target.blamed(
            {.code = Errc::mismatch,
             .message = fmt::format("the driver ran faster than the {} r/min asked for, so the "
                                    "motor was stopped",
                                    plan_->speed()),
             .hint = fmt::format("does the speed of operation data {} come from outside? does {} "
                                 "wait for 'do configure'?",
                                 plan_->operation, facts().analog)}));
        return;
    }
  }

  [[nodiscard]] std::string alarm_words() const {
    std::int64_t code = 0;
    for (const device::MotorNews& news : news_) {
      if (news.event == device::MotorEvent::alarm) code = news.state.alarm;
    }
    return code_words(code, tables_.error);
  }

  static std::string_view result_of(const Result<MotorEnding>& followed) {
    if (!followed) return "";
    switch (*followed) {
      case MotorEnding::elapsed:
        return "ran";
      case MotorEnding::alarm:
        return "alarm";
      case MotorEnding::stopped:
        return "stopped";
      case MotorEnding::ignored:
        return "not-started";
      case MotorEnding::too_fast:
        return "too-fast";
    }
    return "";
  }

  const RemoteStartOptions* options_;
  const MotorPlan* plan_;
  OpenTool* tool_;
  Context* context_;
  GuardedRun guarded_;
  work::ChangeLog log_;
  std::string started_ = {};  ///< the record that the start was begun
  MotorSetup setup_;
  device::MotorStopper stopper_;
  catalogue::CodeTables tables_;
  std::optional<Listing> listing_ = std::nullopt;  ///< from just before the start
  std::vector<device::MotorNews> news_ = {};
};

/// As far as it is known before the driver is asked.
std::string run_in_words(const MotorPlan& plan, const RemoteStartOptions& options,
                         const Target& target) {
  const std::string limit = options.limit ? fmt::format("for {}", spindle::to_text(*options.limit))
                                          : std::string("until it is stopped");
  return fmt::format("run the motor of {} at {} r/min {} {}: the motor will turn", target.shown,
                     plan.speed(), words_of(options.direction_of_motor), limit);
}

/// Asks with what the driver itself says; what would keep it from running is told first.
Result<void> ask_to_run(const MotorPlan& plan, const RemoteStartOptions& options, OpenTool& tool,
                        Context& context) {
  work::ChangeLog log = change_log("remote-start", tool, context);
  MotorSetup setup(plan, tool, context, log);
  const bool agreed = context.user.consent == Consent::given;
  const auto group =
      (agreed ? Result<void>() : setup.look()).and_then([&] { return setup.group_in_words(); });
  if (!group) return tl::unexpected(group.error());
  if (agreed) {
    if (!group->empty()) context.renderer.note(*group);
    return {};
  }
  const std::string what = run_in_words(plan, options, tool.target);
  return ask_away_from(tool, group->empty() ? what : fmt::format("{}; {}", what, *group), context);
}

}  // namespace

Result<Outcome> run_motor(const RemoteStartOptions& options, const Target& target,
                          Context& context) {
  auto opened = open_prepared(target, Need::named_registers, context, [&](const Profile& profile) {
    return plan_motor(options, profile, target).and_then([&](MotorPlan plan) {
      return require_answer(run_in_words(plan, options, target), context).map([&] {
        return std::move(plan);
      });
    });
  });
  if (!opened) return tl::unexpected(std::move(opened.error()));
  auto& [tool, plan] = *opened;
  if (auto agreed = ask_to_run(plan, options, tool, context); !agreed) {
    return tl::unexpected(std::move(agreed.error()));
  }
  return MotorRun(options, plan, tool, context).run();
}

}  // namespace spindle::commands
