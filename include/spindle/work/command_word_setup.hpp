#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "spindle/device/command_word.hpp"
#include "spindle/work/motor_setup.hpp"

namespace spindle::work {

/// What is decided of a run before the driver is touched.
struct WordPlan : MotorPlan {
  std::unique_ptr<const device::CommandWord> motor;
  std::uint16_t operation = 0;
  std::optional<catalogue::Parameter> watchdog_parameter = std::nullopt;
  std::optional<catalogue::Value> watchdog = std::nullopt;
};

/// The operation data and the watchdog, by function 06, which the drivers of a group do not hear.
class WordSetup final : public MotorSetup {
 public:
  WordSetup(const WordPlan& plan, OpenTool& tool, const Environment& environment, ChangeLog& log)
      : MotorSetup(plan.motor->monitor(), tool, environment, log), plan_(&plan) {}

  Result<void> look() override;
  Result<std::string> group_in_words() override;
  Result<void> prepare() override;

  [[nodiscard]] std::uint32_t start_number() const override { return start_word(); }
  Result<void> start(device::Device& device) const override {
    return plan_->motor->command(device, start_word());
  }
  [[nodiscard]] std::unique_ptr<device::Stopper> stopper(catalogue::StopMode mode) const override;
  [[nodiscard]] Duration stopping() const override { return found_.stopping; }
  /// A watchdog that is on gets several queries within its period.
  [[nodiscard]] Duration interval(Duration usual) const override;
  [[nodiscard]] std::string advice() const override;
  [[nodiscard]] std::string hint_not_started() const override;
  [[nodiscard]] std::string hint_too_fast() const override;

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

  [[nodiscard]] const catalogue::CommandWordSpec& facts() const { return plan_->motor->facts(); }
  /// The word of the profile that starts the run, and the same word for this driver.
  [[nodiscard]] std::uint16_t standard_word() const;
  [[nodiscard]] std::uint16_t start_word() const {
    return found_.bits.word(standard_word()).value_or(plan_->motor->idle_word());
  }
  Result<void> read_settings();
  Result<void> check_ready();
  Result<void> check_inputs() const;
  Result<void> check_analog() const;
  Result<void> clear_word();
  Result<void> write_settings();
  Result<void> set_watchdog();
  [[nodiscard]] std::vector<Target> neighbours() const;
  [[nodiscard]] catalogue::Parameter written_as(const catalogue::Parameter& parameter,
                                                const catalogue::Value& before,
                                                const catalogue::Value& value) const override;
  /// A run bit is never set again: it would start the motor as soon as a speed is set.
  void add_left(std::vector<Left>& left) const override;
  [[nodiscard]] std::string left_note(const catalogue::Parameter& parameter) const override;

  const WordPlan* plan_;
  Found found_ = {};
  bool cleared_word_ = false;  ///< it had a run bit, which stays cleared
};

}  // namespace spindle::work
