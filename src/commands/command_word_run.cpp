#include "command_word_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "actions.hpp"
#include "motor_run.hpp"
#include "spindle/base/duration.hpp"
#include "spindle/catalogue/value.hpp"
#include "spindle/work/command_word_setup.hpp"

namespace spindle::commands {
namespace {

using catalogue::CommandWordSpec;
using catalogue::Profile;

/// A shorter one could bite while this program only waits for an answer.
constexpr Duration shortest_watchdog = std::chrono::milliseconds(200);

/// One setting of the operation data, as typed behind an option.
Result<void> add_setting(std::string_view option, const std::string& pattern,
                         const std::string& text, const Profile& profile, WordPlan& plan) {
  if (text.empty()) return {};
  TRY_LET(auto parameter, profile.find(catalogue::numbered_name(pattern, plan.operation)));
  return parse_setting(option, parameter, text).map([&](Setting setting) {
    plan.settings.push_back(std::move(setting));
  });
}

Result<void> plan_watchdog(Duration wanted, WordPlan& plan) {
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

Result<WordPlan> make_plan(const RemoteStartOptions& options, const Profile& profile) {
  if (options.speed.empty()) return tl::unexpected(speed_is_missing());
  TRY_LET(auto motor, device::CommandWord::of(profile));
  WordPlan plan;
  plan.options = options;
  plan.motor = std::make_unique<const device::CommandWord>(std::move(motor));
  const CommandWordSpec& run = plan.motor->facts();
  plan.operation = options.operation.value_or(run.preferred);
  if (plan.operation < run.first || plan.operation > run.last) {
    return tl::unexpected(
        bad_option("--operation", fmt::format("{} does not fit", plan.operation),
                   fmt::format("it takes a number from {} to {}", run.first, run.last)));
  }
  if (auto watchdog = profile.find(run.watchdog)) plan.watchdog_parameter = std::move(*watchdog);
  TRY_LET(const auto speed, profile.find(catalogue::numbered_name(run.speed, plan.operation)));
  auto planned = add_speed(speed, plan)
                     .and_then([&] {
                       return add_setting("--acceleration", run.acceleration, options.acceleration,
                                          profile, plan);
                     })
                     .and_then([&] {
                       return add_setting("--deceleration", run.deceleration, options.deceleration,
                                          profile, plan);
                     });
  if (planned && options.watchdog) planned = plan_watchdog(*options.watchdog, plan);
  if (planned) planned = check_turns(plan);
  return planned.map([&] { return std::move(plan); });
}

class Plan final : public RunPlan {
 public:
  explicit Plan(WordPlan plan) : plan_(std::move(plan)), run_(plan_) {
    if (plan_.watchdog) run_.settings.emplace_back(*plan_.watchdog_parameter, *plan_.watchdog);
  }

  [[nodiscard]] std::string in_words(const Target& target) const override {
    return run_in_words(plan_, target);
  }
  [[nodiscard]] std::unique_ptr<ToolRun> on(OpenTool& tool, Context& context) const override {
    return make_motor_run(run_, plan_.motor->monitor(), tool, context,
                          [&](work::ChangeLog& log) -> std::unique_ptr<MotorSetup> {
                            return std::make_unique<WordSetup>(plan_, tool, context, log);
                          });
  }

 private:
  WordPlan plan_;
  MotorPlan run_;  ///< with the watchdog among what is set
};

}  // namespace

Result<std::unique_ptr<RunPlan>> plan_command_word(const RemoteStartOptions& options,
                                                   const Profile& profile, const Target& target) {
  TRY_LET(auto plan, make_plan(options, profile));
  const auto made = [&]() -> std::unique_ptr<RunPlan> {
    return std::make_unique<Plan>(std::move(plan));
  };
  const auto& actions = profile.actions;
  const auto start = std::find_if(actions.begin(), actions.end(), [](const auto& action) {
    return action.motion == catalogue::Motion::start;
  });
  if (start == actions.end()) return made();
  return check_evidence(*start, target, options.acceptance).map(made);
}

}  // namespace spindle::commands
