#include "command_register_run.hpp"

#include <fmt/format.h>

#include <utility>

#include "motor_run.hpp"
#include "spindle/catalogue/value.hpp"
#include "spindle/device/command_register.hpp"

namespace spindle::commands {
namespace {

using catalogue::CommandRegisterSpec;
using catalogue::Parameter;
using catalogue::Profile;
using catalogue::StopMode;
using catalogue::Value;
using device::CommandRegister;

struct RegisterPlan : MotorPlan {
  std::unique_ptr<const CommandRegister> model;
  std::optional<Parameter> enable = std::nullopt;
};

/// The set-point, and what has to be enabled, which is put back to what it was.
class RegisterSetup final : public MotorSetup {
 public:
  RegisterSetup(const RegisterPlan& plan, OpenTool& tool, Context& context, work::ChangeLog& log)
      : MotorSetup(plan.model->monitor(), tool, context, log), plan_(&plan) {}

  Result<void> look() override { return check_at_rest(); }
  Result<void> prepare() override {
    return look()
        .and_then([&] { return clear_command(); })
        .and_then([&] { return write_settings(); })
        .and_then([&] { return enable(); });
  }

  [[nodiscard]] std::uint32_t start_number() const override {
    const bool forward = plan_->options.direction_of_motor == catalogue::Direction::forward;
    return (forward ? facts().forward : *facts().reverse) | plan_->model->enabling_bit();
  }
  Result<void> start(device::Device& device) const override {
    return plan_->model->command(device, start_number());
  }
  [[nodiscard]] std::unique_ptr<device::Stopper> stopper(StopMode mode) const override {
    auto stopper = std::make_unique<device::CommandRegisterStopper>(*plan_->model, mode);
    stopper->assume_enabled();
    return stopper;
  }
  [[nodiscard]] Duration stopping() const override { return facts().stopping; }
  [[nodiscard]] std::string hint_not_started() const override {
    return "is its main power on, and does it take its commands from the line?";
  }

 private:
  [[nodiscard]] const CommandRegisterSpec& facts() const { return plan_->model->facts(); }

  Result<void> write_settings() {
    for (const auto& [parameter, value] : plan_->settings) {
      if (auto written = write_one(parameter, value); !written) {
        return tl::unexpected(work::of_write(parameter.name, std::move(written.error())));
      }
    }
    return {};
  }

  /// A start that stands at speed 0 would turn the motor when a speed is set, and one that cannot
  /// be read may.
  Result<void> clear_command() {
    const auto found = read_number(plan_->model->command_parameter());
    if (!found && !device::is_refusal(found.error())) return tl::unexpected(found.error());
    const std::uint32_t bit = plan_->model->enabling_bit();
    const std::uint32_t value = found ? *found & ~bit : facts().forward;
    if (value != facts().forward && value != facts().reverse) return {};
    if (found) cleared_ = *found;
    return plan_->model->send_stop(tool().device, StopMode::decelerate, found ? *found & bit : 0);
  }

  Result<std::uint32_t> read_number(const Parameter& parameter) {
    TRY_LET(const auto readings, tool().device.read_each({parameter}, device::Limits::skip));
    const auto& value = readings.front().value;
    if (!value) return tl::unexpected(value.error());
    return static_cast<std::uint32_t>(value->number.mantissa());
  }

  Result<void> enable() {
    if (!plan_->enable) return {};
    const Parameter& parameter = *plan_->enable;
    TRY_LET(const auto before, read_number(parameter));
    const std::uint32_t bit = facts().enable.bit ? std::uint32_t{1} << *facts().enable.bit : 0;
    std::uint32_t present = before;
    if (plan_->model->enabling_bit() != 0) {
      present = *facts().stop | (present & bit);
      auto stopped = present == before ? Result<void>() : settle_command(before & bit);
      if (!stopped) return stopped;
    }
    const std::uint32_t wanted = bit != 0 ? present | bit : facts().enable.value;
    if (wanted == present) return {};
    auto written = changer().make(parameter, {Decimal(present), {}}, {Decimal(wanted), {}});
    if (written.done()) return {};
    return tl::unexpected(work::of_write(parameter.name, std::move(*written.error)));
  }

  Result<void> settle_command(std::uint32_t enabling) {
    return plan_->model->command(tool().device, *facts().stop | enabling);
  }

  /// A harder stop left another value there than the one that was enabled.
  void begin_put_back() override {
    const std::uint32_t bit = plan_->model->enabling_bit();
    if (bit != 0 && facts().instant) static_cast<void>(settle_command(bit));
  }

  void add_left(std::vector<Left>& left) const override {
    if (!cleared_) return;
    left.push_back({.name = facts().command,
                    .set = "a stop",
                    .before = fmt::format("{}", *cleared_),
                    .trouble = "that would start the motor when a speed is set"});
  }

  const RegisterPlan* plan_;
  std::optional<std::uint32_t> cleared_ = std::nullopt;  ///< a start that stood there
};

/// Of the whole model, as no action says where its words come from.
Result<void> check_model(const Profile& profile, const Target& target, Acceptance acceptance) {
  const bool is_weak = profile.run->evidence == catalogue::Evidence::sibling ||
                       profile.run->evidence == catalogue::Evidence::inferred;
  if (!is_weak || acceptance == Acceptance::unverified) return {};
  return tl::unexpected(with_target(
      {.code = Errc::unverified,
       .message = fmt::format("it is not certain that these commands run this tool: evidence {} "
                              "({})",
                              catalogue::to_text(profile.run->evidence), profile.run->source),
       .hint = "try it where nothing can be hurt; then add --accept-unverified"},
      target));
}

Result<RegisterPlan> make_plan(const RemoteStartOptions& options, const Profile& profile) {
  TRY_LET(auto model, CommandRegister::of(profile));
  RegisterPlan plan;
  plan.options = options;
  plan.model = std::make_unique<const CommandRegister>(std::move(model));
  const CommandRegisterSpec& facts = plan.model->facts();
  if (!facts.enable.parameter.empty()) {
    TRY_LET(auto enable, profile.find(facts.enable.parameter));
    plan.enable = std::move(enable);
  }
  if (facts.set_point.empty()) return plan;
  TRY_LET(const auto set_point, profile.find(facts.set_point));
  if (options.speed.empty()) {
    const std::string& unit = set_point.unit;
    return tl::unexpected(speed_is_missing(unit.empty() ? "10" : fmt::format("10{}", unit)));
  }
  return add_speed(set_point, plan).and_then([&] { return check_turns(plan); }).map([&] {
    return std::move(plan);
  });
}

class Plan final : public RunPlan {
 public:
  explicit Plan(RegisterPlan plan) : plan_(std::move(plan)) {}

  [[nodiscard]] std::string in_words(const Target& target) const override {
    return run_in_words(plan_, target);
  }
  [[nodiscard]] std::unique_ptr<ToolRun> on(OpenTool& tool, Context& context) const override {
    return make_motor_run(plan_, plan_.model->monitor(), tool, context,
                          [&](work::ChangeLog& log) -> std::unique_ptr<MotorSetup> {
                            return std::make_unique<RegisterSetup>(plan_, tool, context, log);
                          });
  }

 private:
  RegisterPlan plan_;
};

}  // namespace

Result<std::unique_ptr<RunPlan>> plan_command_register(const RemoteStartOptions& options,
                                                       const Profile& profile,
                                                       const Target& target) {
  TRY(check_model(profile, target, options.acceptance));
  return make_plan(options, profile).map([](RegisterPlan plan) -> std::unique_ptr<RunPlan> {
    return std::make_unique<Plan>(std::move(plan));
  });
}

}  // namespace spindle::commands
