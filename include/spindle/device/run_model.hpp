#pragma once

#include <memory>
#include <string>

#include "spindle/device/motor.hpp"
#include "spindle/device/run_guard.hpp"

namespace spindle::device {

/// Stops one tool, as gently as it was asked to, and harder when that does not help. A stop word
/// never starts anything. May be used again and again without harm.
class Stopper {
 public:
  Stopper() = default;
  Stopper(const Stopper&) = delete;
  Stopper& operator=(const Stopper&) = delete;
  virtual ~Stopper() = default;

  /// The motor was seen to run by what this program sent.
  virtual void seen_running() {}

  /// This program has enabled the motor, or was about to: it stays so while it is stopped, unless
  /// observe() reads that it is not.
  virtual void assume_enabled() {}

  /// Reads how a motor runs that another program started, before the first stop. A stop does not
  /// wait for it: an answer that does not come soon ends it, and what is not known is not needed.
  virtual void observe(Device& device) { static_cast<void>(device); }

  /// Sends a stop and waits for nothing but its acknowledgement.
  virtual Result<void> send(Device& device) = 0;

  /// Sends a stop and waits until it is proven, for no longer than a stop needs.
  virtual Result<StopResult> stop(Device& device, Clock& clock) = 0;
};

/// How a product is started and stopped: one class for each word of `run.model` in a profile.
class RunModel {
 public:
  /// Error `usage` where the profile has no section `run`.
  static Result<std::unique_ptr<const RunModel>> of(const catalogue::Profile& profile);

  RunModel() = default;
  RunModel(const RunModel&) = delete;
  RunModel& operator=(const RunModel&) = delete;
  virtual ~RunModel() = default;

  /// What is read of its motor; null where nothing says how it runs.
  [[nodiscard]] virtual const MotorMonitor* monitor() const = 0;

  /// What depends on the model's own settings and is worth to be told beside the state of the
  /// motor, such as the parameter of an input mode; empty: nothing.
  [[nodiscard]] virtual std::string telling_setting() const { return {}; }

  /// Refers to the model, which must outlive it.
  [[nodiscard]] virtual std::unique_ptr<Stopper> stopper(catalogue::StopMode mode) const = 0;

  /// Tells every tool on the line to stop, once. None of them acknowledges it.
  virtual Result<void> broadcast_stop(Device& device, catalogue::StopMode mode) const = 0;
};

/// Whether the motion of a profile can be followed by polling a motor. Its tools then have other
/// events than those that count their results.
bool has_motor(const catalogue::Profile& profile);

/// What to look at where a stop is not confirmed, as one sentence; empty: the profile says nothing.
std::string still_runs_words(const catalogue::Profile& profile);

}  // namespace spindle::device
