#pragma once

#include <cstdint>
#include <optional>

#include "spindle/base/clock.hpp"
#include "spindle/modbus/pdu.hpp"

namespace spindle::sim {

/// One simulated device of a bus. Knows nothing of other units, frames or connections.
class BusUnit {
 public:
  BusUnit() = default;
  BusUnit(const BusUnit&) = delete;
  BusUnit& operator=(const BusUnit&) = delete;
  virtual ~BusUnit() = default;

  [[nodiscard]] virtual std::uint8_t address() const = 0;
  /// The unit whose group it belongs to; 0: none.
  [[nodiscard]] virtual std::int64_t group() const { return 0; }
  /// Time between a query and its answer, the gap not counted.
  [[nodiscard]] virtual Duration waiting_time() const { return {}; }

  virtual void advance(TimePoint now) = 0;
  [[nodiscard]] virtual std::optional<TimePoint> next_change() const = 0;

  /// A query for this unit, its group or everybody.
  virtual modbus::Pdu answer(const modbus::Pdu& request, TimePoint now) = 0;
  /// A good frame for any unit; a bad one was meant for an unknown one.
  virtual void hear_good_frame() {}
  virtual void hear_bad_frame(TimePoint now) { static_cast<void>(now); }

  virtual void raise_alarm(std::int64_t code, TimePoint now) = 0;
  /// A warning begins; 0 ends it.
  virtual void raise_warning(std::int64_t code, TimePoint now) = 0;
  virtual void use_setter(TimePoint until) { static_cast<void>(until); }
  virtual void power_cycle(TimePoint now) = 0;
};

}  // namespace spindle::sim
