#include "standstill.hpp"

#include <utility>

namespace spindle::device {
namespace {

constexpr Duration confirm_interval = std::chrono::milliseconds(50);

}  // namespace

Result<StopResult> await_standstill(const MotorMonitor& monitor, Device& device, Clock& clock,
                                    TimePoint deadline) {
  bool forgiving = true;  // of one lost answer: the stop itself was acknowledged
  while (true) {
    auto still = monitor.stands_still(device);
    const bool lost = !still && link::is_lost_answer(still.error());
    if (lost && std::exchange(forgiving, false)) continue;
    if (!still) return tl::unexpected(std::move(still.error()));
    if (*still == Shown::yes) return StopResult::confirmed;
    const TimePoint next = clock.now() + confirm_interval;
    if (next > deadline) return StopResult::unconfirmed;
    TRY(clock.sleep_until(next));
  }
}

}  // namespace spindle::device
