#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "spindle/device/run_model.hpp"

namespace spindle::device {

/// `run.model: command-word`: the bits of one word run a motor, in an input mode that decides what
/// they mean, with numbered operation data. Holds names and addresses only.
class CommandWord final : public RunModel {
 public:
  /// Error `usage` where the product has no motor that a command word runs.
  static Result<CommandWord> of(const catalogue::Profile& profile);
  CommandWord(CommandWord&& other) noexcept;

  [[nodiscard]] const catalogue::CommandWordSpec& facts() const { return facts_; }
  [[nodiscard]] const MotorMonitor* monitor() const override { return &monitor_; }
  [[nodiscard]] std::string telling_setting() const override { return facts_.mode; }
  [[nodiscard]] std::unique_ptr<Stopper> stopper(catalogue::StopMode mode) const override;
  Result<void> broadcast_stop(Device& device, catalogue::StopMode mode) const override;

  /// Whether the word is one that runs the motor in this mode.
  [[nodiscard]] bool runs(std::uint16_t word, std::int64_t mode) const;

  /// Whether drivers of this product can be told what the bits of their word do.
  [[nodiscard]] bool has_inputs() const { return !facts_.inputs.parameter.empty(); }

  /// What the bits of the command word do on this driver. Reads the inputs up to the highest bit of
  /// `wanted`, and no less than the lower half, which is one request. Bits behind it are unknown.
  Result<catalogue::CommandBits> read_bits(Device& device, std::uint16_t wanted) const;

  /// A word that starts nothing and stops in every mode, whatever the bits do.
  [[nodiscard]] std::uint16_t idle_word() const;

  /// The command word, by FC 06: its answer repeats it, so it need not wait behind lost answers.
  Result<void> command(Device& device, std::uint16_t word) const;
  [[nodiscard]] modbus::RegisterAddress command_register() const { return command_register_; }

 private:
  CommandWord(const catalogue::CommandWordSpec& facts, MotorMonitor monitor);

  catalogue::CommandWordSpec facts_;
  MotorMonitor monitor_;
  std::vector<catalogue::Parameter> inputs_ = {};
  modbus::RegisterAddress command_register_ = {};
};

/// Stops one motor, as gently as it was asked to, and harder when that does not help.
///
/// A word that decelerates in one input mode starts the motor in another, and a mode that was
/// written but not configured yet cannot be told from one that counts. So the words of a mode are
/// used only for a motor that was seen to run by a word of that mode; else words that stop in every
/// mode. Where the inputs of a driver can be assigned, a word with any bit is used only for a motor
/// that this program started or that was seen to run, and while it is known what the bits do; else
/// the word without any bit, which no assignment takes for a start.
class CommandWordStopper final : public Stopper {
 public:
  CommandWordStopper(const CommandWord& motor, catalogue::StopMode mode)
      : motor_(&motor), mode_(mode) {}

  /// The word of the profile and the input mode by which the motor was started, and what the bits
  /// of this driver do; not trusted until seen to run.
  void started(std::uint16_t word, std::int64_t mode, const catalogue::CommandBits& bits,
               Duration stopping);
  void seen_running() override { seen_running_ = true; }

  /// Reads how a motor runs that another program started, before the first word. A stop does not
  /// wait for it: an answer that does not come soon ends it, and what is not known is not needed.
  void observe(Device& device) override;

  /// Sends a stop and waits for nothing but its acknowledgement.
  Result<void> send(Device& device) override { return motor_->command(device, word()); }

  /// Sends a stop and waits until the motor stands still; when it does not in the time that it
  /// needs, the next call brakes. May be repeated without harm.
  Result<StopResult> stop(Device& device, Clock& clock) override;

  /// How long the motor may need to stand still.
  [[nodiscard]] Duration stopping() const { return stopping_; }

 private:
  [[nodiscard]] std::uint16_t word() const;
  [[nodiscard]] std::uint16_t standard_word() const;
  void observe_run(Device& device);
  void read_stopping(Device& device);

  const CommandWord* motor_;
  catalogue::StopMode mode_;
  std::uint16_t started_by_ = 0;  ///< in bits of the profile
  std::optional<std::int64_t> input_mode_ = std::nullopt;
  std::optional<catalogue::CommandBits> bits_ = std::nullopt;
  bool seen_running_ = false;
  bool harder_ = false;  ///< the gentle stop did not help
  bool knows_stopping_ = false;
  Duration stopping_ = {};
};

/// The longest time that the profile allows for decelerating.
Duration longest_stop(const catalogue::Profile& profile);

}  // namespace spindle::device
