#include "run_motor.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "change_log.hpp"
#include "consent.hpp"
#include "deeds.hpp"
#include "guarded_run.hpp"
#include "listing.hpp"
#include "motor_records.hpp"
#include "records.hpp"
#include "spindle/base/duration.hpp"
#include "spindle/catalogue/value.hpp"
#include "spindle/device/motor_follower.hpp"

namespace spindle::commands {
namespace {

using catalogue::Direction;
using catalogue::Parameter;
using catalogue::Profile;
using catalogue::RunFacts;
using catalogue::Value;
using device::MotorEnding;

/// Between two looks at a running motor; a watchdog that is on is fed more often.
constexpr Duration look_interval = std::chrono::milliseconds(100);
constexpr int looks_per_watchdog = 4;
/// A shorter one could bite while this program only waits for an answer.
constexpr Duration shortest_watchdog = std::chrono::milliseconds(200);

/// Everything that is decided before the driver is touched.
struct MotorPlan {
  device::Motor motor;
  std::uint16_t operation = 0;
  std::vector<std::pair<Parameter, Value>> settings;  ///< of the operation data, the speed first
  std::optional<Parameter> watchdog_parameter;
  std::optional<Value> watchdog;

  [[nodiscard]] std::int64_t speed() const { return settings.front().second.number.mantissa(); }
};

Error bad_option(std::string_view option, std::string message, std::string hint = {}) {
  return {.code = Errc::usage,
          .message = std::move(message),
          .hint = std::move(hint),
          .name = std::string(option)};
}

Result<void> check_options(const RemoteStartOptions& options) {
  for (const auto& [option, text] :
       {std::pair("--preset", &options.preset), std::pair("--direction", &options.direction)}) {
    if (text->empty()) continue;
    return tl::unexpected(bad_option(option, "this product has none",
                                     "it takes --speed, --reverse, --operation and --for"));
  }
  if (!options.speed.empty()) return {};
  return tl::unexpected(
      bad_option("--speed", "is missing: how fast is the motor to turn?", "such as --speed 500"));
}

/// One setting of the operation data, as typed behind an option.
Result<void> add_setting(std::string_view option, const std::string& pattern, std::string text,
                         const Profile& profile, MotorPlan& plan) {
  if (text.empty()) return {};
  auto parameter = profile.find(catalogue::numbered_name(pattern, plan.operation));
  if (!parameter) return tl::unexpected(std::move(parameter.error()));
  if (parameter->unit == "s" && text.ends_with('s')) text.pop_back();
  auto value = catalogue::parse_value(*parameter, text);
  if (!value) {
    value.error().name = option;
    return tl::unexpected(std::move(value.error()));
  }
  plan.settings.emplace_back(std::move(*parameter), std::move(*value));
  return {};
}

Result<void> plan_watchdog(Duration wanted, MotorPlan& plan) {
  if (!plan.watchdog_parameter) {
    return tl::unexpected(bad_option("--watchdog", "this product has none", "leave it out"));
  }
  if (wanted < shortest_watchdog) {
    return tl::unexpected(bad_option(
        "--watchdog", fmt::format("{} is too short to be fed in time", spindle::to_text(wanted)),
        fmt::format("it takes {} or more", spindle::to_text(shortest_watchdog))));
  }
  const auto milliseconds = std::chrono::duration_cast<std::chrono::milliseconds>(wanted).count();
  auto value = catalogue::parse_value(*plan.watchdog_parameter, std::to_string(milliseconds));
  if (!value) {
    value.error().name = "--watchdog";
    return tl::unexpected(std::move(value.error()));
  }
  plan.watchdog = std::move(*value);
  return {};
}

Result<MotorPlan> plan_run(const RemoteStartOptions& options, const Profile& profile,
                           const Target& target) {
  if (auto known = check_options(options); !known) return tl::unexpected(known.error());
  auto motor = device::Motor::of(profile);
  if (!motor) return tl::unexpected(std::move(motor.error()));
  const RunFacts& run = motor->facts();
  MotorPlan plan{.motor = *motor,
                 .operation = options.operation.value_or(run.preferred),
                 .settings = {},
                 .watchdog_parameter = std::nullopt,
                 .watchdog = std::nullopt};
  if (plan.operation < run.first || plan.operation > run.last) {
    return tl::unexpected(
        bad_option("--operation", fmt::format("{} does not fit", plan.operation),
                   fmt::format("it takes a number from {} to {}", run.first, run.last)));
  }
  if (auto watchdog = profile.find(run.watchdog)) plan.watchdog_parameter = std::move(*watchdog);
  auto planned = add_setting("--speed", run.speed, options.speed, profile, plan)
                     .and_then([&] {
                       return add_setting("--acceleration", run.acceleration, options.acceleration,
                                          profile, plan);
                     })
                     .and_then([&] {
                       return add_setting("--deceleration", run.deceleration, options.deceleration,
                                          profile, plan);
                     });
  if (planned && options.watchdog) planned = plan_watchdog(*options.watchdog, plan);
  if (!planned) return tl::unexpected(std::move(planned.error()));
  if (plan.speed() == 0) {
    return tl::unexpected(
        bad_option("--speed", "0 does not turn the motor", "'spindle remote-stop' stops it"));
  }
  const auto start = profile.find_action("start");
  if (!start) return plan;
  return check_evidence(*start, target, options.acceptance).map([&] { return std::move(plan); });
}

std::string_view words_of(Direction direction) {
  return direction == Direction::forward ? "forward" : "in reverse";
}

/// What the driver is set to before anything is changed.
struct Found {
  std::int64_t mode = 0;
  std::uint16_t word = 0;
  std::int64_t analog = 0;
  std::optional<Value> watchdog;
  Duration stopping = {};
};

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
        log_("remote-start", tool, context),
        stopper_(plan.motor, options.stop.value_or(catalogue::StopMode::decelerate)) {}

  Result<Outcome> run() {
    auto ready = read_settings()
                     .and_then([&] { return check_ready(); })
                     .and_then([&] { return clear_word(); })
                     .and_then([&] { return write_settings(); });
    if (!ready) return tl::unexpected(std::move(ready.error()));
    if (auto armed = set_watchdog(); !armed) return tl::unexpected(std::move(armed.error()));
    const std::uint16_t word = start_word();
    stopper_.started(word, found_.mode, found_.stopping);
    if (context_->calm.stay_awake) context_->calm.stay_awake();
    device::RunGuard guard(tool_->device, motion(word), guarded_.reopener(), context_->calm.clock);
    const device::MotorFollowOptions following = limit_run();
    auto followed = guard.start().and_then([&] {
      return device::follow_motor(tool_->device, plan_->motor, stopper_, following, news_);
    });
    const device::StopReport stop = guard.stop();
    guarded_.clear_state();  // not before the stop: a terminal may keep its writer waiting
    note_stop(stop);
    restore_watchdog(stop);
    return report(followed, stop);
  }

 private:
  [[nodiscard]] const RunFacts& facts() const { return plan_->motor.facts(); }

  Result<void> read_settings() {
    const RunFacts& run = facts();
    std::vector<std::string> names = {run.command, run.mode,
                                      catalogue::numbered_name(run.deceleration, plan_->operation)};
    for (const std::string* name : {&run.analog, &run.watchdog}) {
      if (!name->empty()) names.push_back(*name);
    }
    auto wanted = tool_->profile->select(names);
    if (!wanted) return tl::unexpected(std::move(wanted.error()));
    const auto readings = tool_->device.read_each(*wanted, device::Limits::skip);
    if (!readings) return tl::unexpected(readings.error());
    for (const device::Reading& reading : *readings) {
      if (!reading.value) return tl::unexpected(reading.value.error());
    }
    const auto value = [&](std::size_t at) { return *(*readings)[at].value; };
    found_.word = static_cast<std::uint16_t>(value(0).number.mantissa());
    found_.mode = value(1).number.mantissa();
    found_.stopping = device::time_of((*readings)[2], device::longest_stop(*tool_->profile));
    std::size_t next = 3;
    found_.analog = run.analog.empty() ? run.digital : value(next++).number.mantissa();
    if (!run.watchdog.empty()) found_.watchdog = value(next);
    return {};
  }

  Error not_ready(std::string message, std::string hint) const {
    return tool_->target.blamed(
        {.code = Errc::negative, .message = std::move(message), .hint = std::move(hint)});
  }

  Result<void> check_ready() {
    const auto state = plan_->motor.look(tool_->device);
    if (!state) return tl::unexpected(state.error());
    if (state->alarm != 0) {
      return tl::unexpected(not_ready(
          fmt::format("alarm {:02X}h is present, so the motor was not started", state->alarm),
          "'spindle alarms' shows what it means"));
    }
    if (state->running || state->command_speed != 0) {
      return tl::unexpected(
          not_ready("the motor runs already, so it was not started",
                    "wait until it stands still, or stop it with 'spindle remote-stop'"));
    }
    if (state->busy) {
      return tl::unexpected(
          not_ready("the driver is busy, so the motor was not started", "try again in a second"));
    }
    if (!facts().modes.contains(found_.mode)) {
      return tl::unexpected(not_ready(
          fmt::format("{} is {}, which the profile does not know", facts().mode, found_.mode),
          "'spindle get' shows it"));
    }
    return check_analog();
  }

  Result<void> check_analog() const {
    const RunFacts& run = facts();
    const bool from_outside =
        !run.analog.empty() && found_.analog != run.digital && plan_->operation <= run.analog_to;
    if (!from_outside) return {};
    return tl::unexpected(
        bad_option("--operation",
                   fmt::format("the speed of operation data {} comes from outside while {} is {}",
                               plan_->operation, run.analog, found_.analog),
                   fmt::format("use --operation {}, or set {}={} and run 'do configure'",
                               run.preferred, run.analog, run.digital)));
  }

  /// A word that runs at speed 0 would start the motor when its speed is set.
  Result<void> clear_word() {
    if ((found_.word & facts().starting) == 0) return {};
    return plan_->motor.command(tool_->device, facts().decelerate_always);
  }

  Result<void> write_one(const Parameter& parameter, const Value& value) {
    const auto before = tool_->device.read_each({parameter}, device::Limits::skip);
    if (!before) return tl::unexpected(before.error());
    const device::Reading& reading = before->front();
    if (!reading.value) return tl::unexpected(reading.value.error());
    if (*reading.value == value) return {};
    const auto written = tool_->device.write(parameter, *reading.value, value);
    if (!written) return tl::unexpected(written.error());
    const bool done = written->result == device::WriteResult::written;
    log_.add(logged(parameter, *reading.value, written->now, done ? "written" : "coerced"));
    if (done) return {};
    return tl::unexpected(
        tool_->target.blamed({.code = Errc::mismatch,
                              .message = fmt::format("the driver acknowledged {} but holds {}",
                                                     value.to_string(), written->now.to_string()),
                              .name = parameter.name,
                              .register_address = parameter.address.value}));
  }

  Result<void> write_settings() {
    for (const auto& [parameter, value] : plan_->settings) {
      if (auto written = write_one(parameter, value); !written) return written;
      const bool is_stop =
          parameter.name == catalogue::numbered_name(facts().deceleration, plan_->operation);
      if (is_stop) {
        device::Reading reading{.parameter = parameter, .registers = {}, .value = value};
        found_.stopping = device::time_of(reading, found_.stopping);
      }
    }
    return {};
  }

  Result<void> set_watchdog() {
    const bool is_off = !found_.watchdog || found_.watchdog->number == Decimal(0);
    if (plan_->watchdog) return write_one(*plan_->watchdog_parameter, *plan_->watchdog);
    if (is_off && plan_->watchdog_parameter) {
      context_->renderer.note(
          fmt::format("{}: {} is off: if this program or the line fails, the motor runs on; with "
                      "--watchdog 1s the driver itself stops it",
                      tool_->target.shown, plan_->watchdog_parameter->name));
    }
    return {};
  }

  [[nodiscard]] std::uint16_t start_word() const {
    const catalogue::RunWords& words = facts().modes.at(found_.mode);
    const unsigned run =
        options_->direction_of_motor == Direction::forward ? words.forward : words.reverse;
    return static_cast<std::uint16_t>(run | facts().selecting(plan_->operation));
  }

  device::GuardedMotion motion(std::uint16_t word) {
    return {.start = [this,
                      word](device::Device& device) { return plan_->motor.command(device, word); },
            .stop = [this](device::Device& device,
                           Clock& clock) { return stopper_.stop(device, clock); },
            .stopping = found_.stopping};
  }

  device::MotorFollowOptions limit_run() {
    device::MotorFollowOptions following;
    following.fastest = plan_->speed();
    following.interval = look_interval;
    const auto& watchdog = plan_->watchdog ? plan_->watchdog : found_.watchdog;
    if (watchdog && watchdog->number != Decimal(0)) {
      const Duration bites = std::chrono::milliseconds(watchdog->number.mantissa());
      following.interval = std::min(look_interval, bites / looks_per_watchdog);
    }
    following.progress = [this](Duration elapsed, const device::MotorState& state) {
      auto read = guarded_.check_reader();
      if (read) guarded_.show_running(elapsed, fmt::format(", {} r/min", state.feedback_speed));
      return read;
    };
    if (options_->limit) following.deadline = context_->clock.now() + *options_->limit;
    return following;
  }

  /// A stop that was confirmed is the end of what the motor did.
  void note_stop(const device::StopReport& stop) {
    const bool stopped_already = std::any_of(
        news_.begin(), news_.end(),
        [](const device::MotorNews& news) { return news.event == device::MotorEvent::stopped; });
    if (stop.result != device::StopResult::confirmed || news_.empty() || stopped_already) return;
    device::MotorState state;
    if (const auto now = plan_->motor.look(tool_->device)) state = *now;
    news_.push_back({device::MotorEvent::stopped, state, context_->clock.wall()});
  }

  void restore_watchdog(const device::StopReport& stop) {
    const bool changed =
        plan_->watchdog && found_.watchdog && !(*plan_->watchdog == *found_.watchdog);
    if (!changed || stop.result != device::StopResult::confirmed) return;
    const auto restored =
        tool_->device.write(*plan_->watchdog_parameter, *plan_->watchdog, *found_.watchdog);
    const bool done = restored && restored->result == device::WriteResult::written;
    log_.add(logged(*plan_->watchdog_parameter, *plan_->watchdog, *found_.watchdog,
                    done ? "written" : "unknown"));
    if (done) return;
    context_->renderer.note(fmt::format("{}: {} could not be set back to {}", tool_->target.shown,
                                        plan_->watchdog_parameter->name,
                                        found_.watchdog->to_string()));
  }

  Result<Outcome> report(const Result<MotorEnding>& followed, const device::StopReport& stop) {
    const auto tables = context_->profiles.load_code_tables(tool_->profile->path);
    const catalogue::CodeTables known = tables.value_or(catalogue::CodeTables());
    const auto columns = motor_columns(Tools::one);
    Listing listing(*context_, columns);
    for (const device::MotorNews& news : news_) {
      listing.add(motor_record(news, tool_->target, known));
    }
    log_run(followed, stop);
    judge(followed, known);
    const std::string_view result = result_of(followed);
    return guarded_.end(listing, stop,
                        {.result = std::string(result),
                         .subject = result == "ran" ? "ran; the motor" : "the motor"});
  }

  void log_run(const Result<MotorEnding>& followed, const device::StopReport& stop) {
    log_.add({.name = "start",
              .new_value = Decimal(start_word()),
              .result = log_word(result_of(followed), stop)});
  }

  void judge(const Result<MotorEnding>& followed, const catalogue::CodeTables& tables) {
    if (!followed) {
      guarded_.fail_following(followed.error());
      return;
    }
    switch (*followed) {
      case MotorEnding::elapsed:
        guarded_.outcome().succeed();
        return;
      case MotorEnding::alarm:
        guarded_.fail(not_ready(fmt::format("alarm {} ended the run", alarm_words(tables)),
                                "'spindle alarms' shows what helps"));
        return;
      case MotorEnding::stopped:
        guarded_.fail(not_ready("the motor stopped before its time, and not by this program",
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

  [[nodiscard]] std::string alarm_words(const catalogue::CodeTables& tables) const {
    std::int64_t code = 0;
    for (const device::MotorNews& news : news_) {
      if (news.event == device::MotorEvent::alarm) code = news.state.alarm;
    }
    return code_words(code, tables.error);
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
  ChangeLog log_;
  device::MotorStopper stopper_;
  Found found_ = {};
  std::vector<device::MotorNews> news_ = {};
};

}  // namespace

Result<Outcome> run_motor(const RemoteStartOptions& options, const Target& target,
                          Context& context) {
  auto opened = open_prepared(target, Need::named_registers, context, [&](const Profile& profile) {
    return plan_run(options, profile, target).and_then([&](MotorPlan plan) {
      const std::string what = fmt::format("run the motor of {} at {} r/min {}", target.shown,
                                           plan.speed(), words_of(options.direction_of_motor));
      return ask_consent(what, context).map([&] { return std::move(plan); });
    });
  });
  if (!opened) return tl::unexpected(std::move(opened.error()));
  return MotorRun(options, opened->prepared, opened->tool, context).run();
}

}  // namespace spindle::commands
