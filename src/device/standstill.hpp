#pragma once

#include "spindle/device/run_model.hpp"

namespace spindle::device {

/// Behind a stop that was acknowledged: waits until the motor stands still, or the deadline is
/// over. One lost answer is forgiven.
Result<StopResult> await_standstill(const MotorMonitor& monitor, Device& device, Clock& clock,
                                    TimePoint deadline);

}  // namespace spindle::device
