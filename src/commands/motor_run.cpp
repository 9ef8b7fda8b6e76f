#include "motor_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "consent.hpp"
#include "listing.hpp"
#include "motor_records.hpp"
#include "spindle/base/duration.hpp"
#include "spindle/device/motor_follower.hpp"

namespace spindle::commands {
namespace {

using catalogue::Direction;
using device::MotorEnding;

/// Between two looks at a running motor.
constexpr Duration look_interval = std::chrono::milliseconds(100);

std::string_view words_of(Direction direction) {
  return direction == Direction::forward ? "forward" : "in reverse";
}

/// As in records.
constexpr auto ending_words = enum_table<MotorEnding>({{"ran", MotorEnding::elapsed},
                                                       {"alarm", MotorEnding::alarm},
                                                       {"stopped", MotorEnding::stopped},
                                                       {"not-started", MotorEnding::ignored},
                                                       {"too-fast", MotorEnding::too_fast},
                                                       {"not-seen", MotorEnding::unseen}});

/// One run of a motor: what is told of it, and how it ended.
class MotorRun final : public ToolRun {
 public:
  MotorRun(const MotorPlan& plan, const device::MotorMonitor* monitor, OpenTool& tool,
           Context& context, const MakeMotorSetup& make_setup)
      : ToolRun(tool, context), plan_(&plan), monitor_(monitor), setup_(make_setup(log())) {}

  Result<void> ask() override;
  [[nodiscard]] std::string settings_in_words() const override {
    return commands::settings_in_words(plan_->settings);
  }
  Result<void> prepare() override {
    tables_ =
        context().profiles.load_code_tables(tool().profile->path).value_or(catalogue::CodeTables());
    return setup_->prepare().map([this] {
      if (const auto advice = setup_->advice(); !advice.empty()) context().renderer.note(advice);
    });
  }
  [[nodiscard]] std::vector<report::Column> columns() const override {
    if (context().user.format == report::Format::csv) {
      return exchange_columns({tool().profile.get()});
    }
    return motor_columns(Tools::one);
  }
  [[nodiscard]] work::LoggedChange start_change() const override {
    return {.name = "start", .new_value = Decimal(setup_->start_number())};
  }
  [[nodiscard]] device::GuardedMotion motion() override {
    stopper_ = setup_->stopper(plan_->options.stop.value_or(catalogue::StopMode::decelerate));
    return {.start = [this](device::Device& device) { return setup_->start(device); },
            .stop = [this](device::Device& device,
                           Clock& clock) { return stopper_->stop(device, clock); },
            .stopping = setup_->stopping()};
  }

  void begin() override {
    following_.fastest = plan_->speed;
    following_.interval = setup_->interval(look_interval);
    following_.progress = [this](Duration elapsed, const device::MotorState& state) {
      auto read = output().check_reader();
      if (read) output().show_running(elapsed, speed_in_words(state));
      return read;
    };
    following_.on_transition = [this](const device::MotorTransition& news) { tell(news); };
    const auto& limit = plan_->options.limit;
    if (limit) following_.deadline = context().clock.now() + *limit;
  }

  Result<void> follow() override {
    TRY_LET(auto ending, monitor_ == nullptr ? device::wait_unseen(tool().device, following_)
                                             : device::follow_motor(tool().device, *monitor_,
                                                                    *stopper_, following_));
    ending_ = ending;
    return {};
  }

  /// An alarm may have ended the run where the program did not look: by the driver's own watchdog
  /// while this program was kept from asking it.
  void look_back(Result<void>& followed, const device::StopReport& stop) override {
    if (stop.result != device::StopResult::confirmed || monitor_ == nullptr) return;
    auto state = monitor_->look(tool().device);
    if (!state) state = monitor_->look(tool().device);
    if (!state) {
      if (followed && ending_ == MotorEnding::elapsed) {
        followed = tl::unexpected(std::move(state.error()));
      }
      state = device::MotorState();
    }
    const WallTime now = context().clock.wall();
    if (state->alarm != 0) {
      if (!has_told(device::MotorEvent::alarm)) tell({device::MotorEvent::alarm, *state, now});
      if (followed) ending_ = MotorEnding::alarm;
    }
    if (!news_.empty() && !has_told(device::MotorEvent::stopped)) {
      tell({device::MotorEvent::stopped, *state, now});
    }
  }

  std::vector<Left> put_back() override { return setup_->put_back(); }
  [[nodiscard]] std::vector<Left> left() const override { return setup_->left(); }

  RunEnd judge(const Result<void>& followed) override {
    if (!followed) {
      output().fail_following(followed.error());
    } else if (auto error = error_of(*ending_)) {
      output().fail(*error);
    } else {
      output().outcome().succeed();
    }
    const std::string result(followed ? ending_words.text(*ending_) : "");
    return {.result = result,
            .subject = result == "ran" ? "ran; the motor" : "the motor",
            .logged = result};
  }

 private:
  [[nodiscard]] std::string speed_in_words(const device::MotorState& state) const {
    if (!state.feedback_speed) return {};
    return fmt::format(", {} {}", state.feedback_speed->to_string(), plan_->speed_unit);
  }

  void tell(const device::MotorTransition& news) {
    news_.push_back(news);
    output().add(motor_record(news, tool().target, tables_));
  }

  [[nodiscard]] bool has_told(device::MotorEvent event) const {
    return std::any_of(news_.begin(), news_.end(),
                       [&](const device::MotorTransition& news) { return news.event == event; });
  }

  /// Why it did not run to its end as it should.
  [[nodiscard]] std::optional<Error> error_of(MotorEnding ending) const {
    const Target& target = tool().target;
    switch (ending) {
      case MotorEnding::elapsed:
        return std::nullopt;
      case MotorEnding::alarm:
        return not_ready(target, fmt::format("alarm {} ended the run", alarm_words()),
                         "'spindle alarms' shows what helps");
      case MotorEnding::stopped:
        return not_ready(target, "the motor stopped before its time, and not by this program",
                         "does another program command it?");
      case MotorEnding::ignored:
        return with_target(
            {.code = Errc::mismatch,
             .message = "the driver acknowledged the start, but the motor does not run",
             .hint = setup_->hint_not_started()},
            target);
      case MotorEnding::too_fast:
        return with_target(
            {.code = Errc::mismatch,
             .message = fmt::format("the driver ran faster than the {} asked for, so the motor was "
                                    "stopped",
                                    plan_->speed_in_words()),
             .hint = setup_->hint_too_fast()},
            target);
      case MotorEnding::unseen:
        return not_ready(target,
                         "start and stop were acknowledged, but nothing that can be read says "
                         "whether the motor ran, and whether it stands still",
                         "look at it; 'run' in its profile names no status and no speed");
    }
    return std::nullopt;
  }

  [[nodiscard]] std::string alarm_words() const {
    std::int64_t code = 0;
    for (const device::MotorTransition& news : news_) {
      if (news.event == device::MotorEvent::alarm) code = news.state.alarm;
    }
    return code_words(code, tables_.error);
  }

  const MotorPlan* plan_;
  const device::MotorMonitor* monitor_;
  std::unique_ptr<MotorSetup> setup_;
  std::unique_ptr<device::Stopper> stopper_ = nullptr;
  catalogue::CodeTables tables_ = {};
  device::MotorFollowOptions following_ = {};
  std::optional<MotorEnding> ending_ = std::nullopt;  ///< empty: it could not be followed
  std::vector<device::MotorTransition> news_ = {};
};

/// Asks with what the driver itself says; what would keep it from running is told first.
Result<void> MotorRun::ask() {
  const bool agreed = context().user.consent == Consent::given;
  const auto group =
      (agreed ? Result<void>() : setup_->look()).and_then([&] { return setup_->group_in_words(); });
  if (!group) return tl::unexpected(group.error());
  if (agreed) {
    if (!group->empty()) context().renderer.note(*group);
    return {};
  }
  const std::string what = run_in_words(*plan_, tool().target);
  return ask_away_from(tool(), group->empty() ? what : fmt::format("{}; {}", what, *group),
                       context());
}

}  // namespace

std::unique_ptr<ToolRun> make_motor_run(const MotorPlan& plan, const device::MotorMonitor* monitor,
                                        OpenTool& tool, Context& context,
                                        const MakeMotorSetup& make_setup) {
  return std::make_unique<MotorRun>(plan, monitor, tool, context, make_setup);
}

std::string run_in_words(const MotorPlan& plan, const Target& target) {
  const auto& options = plan.options;
  const std::string limit = options.limit ? fmt::format("for {}", spindle::to_text(*options.limit))
                                          : std::string("until it is stopped");
  const std::string speed = plan.speed ? fmt::format(" at {}", plan.speed_in_words()) : "";
  return fmt::format("run the motor of {}{} {} {}: the motor will turn", target.shown, speed,
                     words_of(options.direction_of_motor), limit);
}

Error speed_is_missing(std::string_view example) {
  return bad_option("--speed", "is missing: how fast is the motor to turn?",
                    fmt::format("such as --speed {}", example));
}

Result<void> check_turns(const MotorPlan& plan) {
  if (!plan.speed || *plan.speed != Decimal(0)) return {};
  return tl::unexpected(
      bad_option("--speed", "0 does not turn the motor", "'spindle remote-stop' stops it"));
}

}  // namespace spindle::commands
