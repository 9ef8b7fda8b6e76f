#pragma once

#include <utility>

#include "register_bank.hpp"
#include "spindle/sim/fault_plan.hpp"

namespace spindle::sim {

/// Stores what is written as the faults say that concern a device: ignore_write, store_other,
/// reset_neighbour. They count accepted writes from 1.
class FaultyStore {
 public:
  explicit FaultyStore(FaultPlan faults) : faults_(std::move(faults)) {}

  /// A write was accepted. Whether the device does what it says.
  [[nodiscard]] bool accept();
  /// Stores the value of the last accepted write.
  void store(const Place& place, RegisterView registers, RegisterBank& bank) const;

 private:
  [[nodiscard]] const Fault* struck(FaultKind kind) const;

  FaultPlan faults_;
  std::uint32_t writes_ = 0;
};

}  // namespace spindle::sim
