#include "motor_plan.hpp"

#include <fmt/format.h>

#include "actions.hpp"
#include "spindle/base/duration.hpp"
#include "spindle/catalogue/value.hpp"

namespace spindle::commands {
namespace {

using catalogue::Profile;
using catalogue::RunFacts;

/// A shorter one could bite while this program only waits for an answer.
constexpr Duration shortest_watchdog = std::chrono::milliseconds(200);

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

}  // namespace

Result<MotorPlan> plan_motor(const RemoteStartOptions& options, const Profile& profile,
                             const Target& target) {
  if (auto known = check_options(options); !known) return tl::unexpected(known.error());
  auto motor = device::Motor::of(profile);
  if (!motor) return tl::unexpected(std::move(motor.error()));
  const RunFacts& run = motor->facts();
  MotorPlan plan{.motor = *motor,
                 .operation = options.operation.value_or(run.preferred),
                 .direction = options.direction_of_motor,
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

Error bad_option(std::string_view option, std::string message, std::string hint) {
  return {.code = Errc::usage,
          .message = std::move(message),
          .hint = std::move(hint),
          .name = std::string(option)};
}

}  // namespace spindle::commands
