#pragma once

#include <cstdint>
#include <optional>

#include "spindle/device/run_model.hpp"

namespace spindle::device {

/// `run.model: command-register`: values of one register of 16 or 32 bits run a motor. It may have
/// to be enabled before, and another register may stop it.
class CommandRegister final : public RunModel {
 public:
  /// Requires a profile with such a model.
  static Result<CommandRegister> of(const catalogue::Profile& profile);
  CommandRegister(CommandRegister&& other) noexcept;

  [[nodiscard]] const catalogue::CommandRegisterSpec& facts() const { return facts_; }
  [[nodiscard]] const catalogue::Parameter& command_parameter() const { return command_; }
  [[nodiscard]] const MotorMonitor* monitor() const override {
    return monitor_ ? &*monitor_ : nullptr;
  }
  [[nodiscard]] std::unique_ptr<Stopper> stopper(catalogue::StopMode mode) const override;
  Result<void> broadcast_stop(Device& device, catalogue::StopMode mode) const override;

  /// The bit of the command register without which it is not obeyed; 0: there is none.
  [[nodiscard]] std::uint32_t enabling_bit() const;
  /// The value that stops, without that bit; empty: only another register stops it.
  [[nodiscard]] std::optional<std::uint32_t> stop_value(catalogue::StopMode mode) const;

  /// Writes a value to the command register, once.
  Result<void> command(Device& device, std::uint32_t value) const;
  /// Stops by every register that the profile names for it; `enabling` is kept as it is given.
  Result<void> send_stop(Device& device, catalogue::StopMode mode, std::uint32_t enabling) const;

 private:
  CommandRegister(const catalogue::CommandRegisterSpec& facts, catalogue::Parameter command);

  catalogue::CommandRegisterSpec facts_;
  catalogue::Parameter command_;
  std::optional<catalogue::Parameter> stop_ = std::nullopt;
  std::optional<MotorMonitor> monitor_ = std::nullopt;
};

/// Stops by the values of the profile. Where nothing proves a standstill, a stop is `sent`.
class CommandRegisterStopper final : public Stopper {
 public:
  CommandRegisterStopper(const CommandRegister& model, catalogue::StopMode mode)
      : model_(&model), mode_(mode) {}

  void assume_enabled() override { enabling_ = model_->enabling_bit(); }
  /// Reads whether it is enabled.
  void observe(Device& device) override;
  Result<void> send(Device& device) override;
  Result<StopResult> stop(Device& device, Clock& clock) override;

 private:
  const CommandRegister* model_;
  catalogue::StopMode mode_;
  std::uint32_t enabling_ = 0;  ///< nothing is known: a stop does not enable
};

}  // namespace spindle::device
