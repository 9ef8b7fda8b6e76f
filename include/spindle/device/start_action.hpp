#pragma once

#include "spindle/device/run_model.hpp"

namespace spindle::device {

/// `run.model: start-action`: an action with `stop` starts the tool and stops it, and a parameter
/// says whether it runs.
class StartAction final : public RunModel {
 public:
  /// Requires a profile with such a model.
  static Result<StartAction> of(const catalogue::Profile& profile);

  [[nodiscard]] const MotorMonitor* monitor() const override { return nullptr; }
  [[nodiscard]] std::unique_ptr<Stopper> stopper(catalogue::StopMode mode) const override;
  Result<void> broadcast_stop(Device& device, catalogue::StopMode mode) const override;

  [[nodiscard]] const catalogue::Action& start() const { return start_; }
  [[nodiscard]] const catalogue::StartActionSpec& facts() const { return facts_; }

  StartAction(StartAction&& other) noexcept
      : facts_(std::move(other.facts_)), start_(std::move(other.start_)) {}

 private:
  StartAction(catalogue::StartActionSpec facts, catalogue::Action start)
      : facts_(std::move(facts)), start_(std::move(start)) {}

  catalogue::StartActionSpec facts_;
  catalogue::Action start_;
};

}  // namespace spindle::device
