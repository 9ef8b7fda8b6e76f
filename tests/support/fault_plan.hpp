#pragma once

#include <string>
#include <vector>

#include "spindle/sim/fault_plan.hpp"

namespace spindle::test {

/// The faults as they are typed behind --fault.
inline sim::FaultPlan plan_of(const std::vector<std::string>& texts) {
  sim::FaultPlan plan;
  for (const std::string& text : texts) plan.push_back(sim::parse_fault(text).value());
  return plan;
}

}  // namespace spindle::test
