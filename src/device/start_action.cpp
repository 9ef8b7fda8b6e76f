#include "spindle/device/start_action.hpp"

#include <utility>

namespace spindle::device {
namespace {

class ActionStopper final : public Stopper {
 public:
  explicit ActionStopper(const catalogue::Action& start) : start_(&start) {}

  Result<void> send(Device& device) override { return device.send_stop(*start_); }
  Result<StopResult> stop(Device& device, Clock& clock) override {
    return stop_and_confirm(device, *start_, clock);
  }

 private:
  const catalogue::Action* start_;
};

}  // namespace

Result<StartAction> StartAction::of(const catalogue::Profile& profile) {
  const catalogue::StartActionSpec& facts = *profile.run->action();
  TRY_LET(auto start, profile.find_action(facts.start));
  return StartAction(facts, std::move(start));
}

std::unique_ptr<Stopper> StartAction::stopper(catalogue::StopMode /*mode*/) const {
  return std::make_unique<ActionStopper>(start_);
}

Result<void> StartAction::broadcast_stop(Device& device, catalogue::StopMode /*mode*/) const {
  return device.broadcast(start_, *start_.stop_value);
}

}  // namespace spindle::device
