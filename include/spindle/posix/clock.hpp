#pragma once

#include "spindle/base/clock.hpp"
#include "spindle/base/interrupt.hpp"

namespace spindle::posix {

/// CLOCK_MONOTONIC, CLOCK_REALTIME and the zone of $TZ or of this computer. Sleeping polls the
/// interrupt's descriptor.
class SteadyClock final : public Clock {
 public:
  explicit SteadyClock(const Interrupt& interrupt) : interrupt_(&interrupt) {}
  [[nodiscard]] TimePoint now() const override;
  [[nodiscard]] WallTime wall() const override;
  [[nodiscard]] std::chrono::seconds utc_offset(WallTime time) const override;
  Result<void> sleep_until(TimePoint deadline) override;

 private:
  const Interrupt* interrupt_;
};

/// A clock whose sleeps nothing ends, for what has to be done after a signal.
struct CalmTime {
  const Interrupt interrupt = Interrupt();  ///< never raised
  SteadyClock clock = SteadyClock(interrupt);
};

}  // namespace spindle::posix
