#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "change_log.hpp"
#include "guarded_run.hpp"
#include "motor_plan.hpp"
#include "spindle/commands/context.hpp"
#include "spindle/device/rollback.hpp"
#include "spindle/work/uninterruptible_line.hpp"

namespace spindle::commands {

/// What a driver is set to before its motor runs, and what of it is set back afterwards.
class MotorSetup {
 public:
  /// All must outlive it.
  MotorSetup(const MotorPlan& plan, OpenTool& tool, Context& context, work::ChangeLog& log)
      : plan_(&plan),
        tool_(&tool),
        context_(&context),
        changer_(tool.device, log),
        calm_line_(tool, context) {}

  /// Reads what the run depends on, and checks that the motor may be started. Only reads.
  Result<void> look();

  /// What a group of drivers means for the run, as far as this driver and those of the tools file
  /// on its line tell it; empty where it belongs to none. Only reads.
  Result<std::string> group_in_words();

  /// Looks, and then writes the operation data and the watchdog: by function 06, which the
  /// drivers of a group do not hear. The motor does not turn.
  Result<void> prepare();

  /// Of a motor that stands still, also after prepare() failed: sets back what was written. Not
  /// ended by an interrupt, and reopens a lost link. Returns what could not be set back.
  std::vector<Left> put_back();

  /// What was written and not set back, of a motor that may still run.
  [[nodiscard]] std::vector<Left> left() const;

  /// By which the words of the run are chosen.
  [[nodiscard]] std::int64_t input_mode() const { return found_.mode; }
  /// What the bits of the command word do on this driver.
  [[nodiscard]] const catalogue::CommandBits& bits() const { return found_.bits; }
  /// The word of the profile that starts the run.
  [[nodiscard]] std::uint16_t standard_word() const;
  /// The same word for this driver. Requires that prepare() succeeded.
  [[nodiscard]] std::uint16_t start_word() const {
    return found_.bits.word(standard_word()).value_or(plan_->motor.idle_word());
  }
  /// How long the motor takes to decelerate, as it is set now.
  [[nodiscard]] Duration stopping() const { return found_.stopping; }
  /// The one that is in force during the run; empty or 0 where there is none.
  [[nodiscard]] const std::optional<catalogue::Value>& watchdog() const {
    return plan_->watchdog ? plan_->watchdog : found_.watchdog;
  }

 private:
  /// Before anything is changed.
  struct Found {
    std::int64_t mode = 0;
    std::uint16_t word = 0;
    catalogue::CommandBits bits = {};
    std::int64_t analog = 0;
    std::optional<catalogue::Value> watchdog;
    Duration stopping = {};
  };

  [[nodiscard]] const catalogue::RunFacts& facts() const { return plan_->motor.facts(); }
  Result<void> read_settings();
  Result<void> check_ready();
  Result<void> check_inputs() const;
  Result<void> check_analog() const;
  Result<void> clear_word();
  Result<void> write_one(const catalogue::Parameter& parameter, const catalogue::Value& value);
  Result<void> write_settings();
  Result<void> set_watchdog();
  [[nodiscard]] std::vector<Target> neighbours() const;
  [[nodiscard]] Left left_of(const device::TriedWrite& write, std::string trouble) const;
  void add_cleared_word(std::vector<Left>& left) const;

  const MotorPlan* plan_;
  OpenTool* tool_;
  Context* context_;
  work::Changer changer_;
  UninterruptibleLine calm_line_;
  Found found_ = {};
  bool cleared_word_ = false;  ///< it had a run bit, which stays cleared
};

}  // namespace spindle::commands
