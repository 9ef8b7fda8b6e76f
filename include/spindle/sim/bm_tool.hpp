#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>

#include "spindle/base/error.hpp"
#include "spindle/catalogue/profile.hpp"
#include "spindle/sim/fault_plan.hpp"
#include "spindle/sim/server.hpp"

namespace spindle::sim {

/// What `spindle simulate` and tests may change on a simulated BM/BMT.
struct BmOptions {
  std::optional<std::size_t> identity_bytes =
      std::nullopt;  ///< 12, 13 or 17; default: the profile's
  std::optional<std::uint16_t> firmware = std::nullopt;
  std::optional<std::uint32_t> serial = std::nullopt;  ///< four-byte serial
  std::optional<std::uint16_t> tool_model = std::nullopt;
  FaultPlan faults = {};  ///< only those that concern the tool: ignore_write, store_other
};

/// A simulated BM/BMT screwdriver: parameters 1–725 with holes and MIN/MAX mirrors, live status,
/// last event, remote inputs with the sibling's mapping, a run-down with ramping torque, alarms,
/// auto output that expires, identity. All registers, scales and start values come from the
/// profile, so it shares the catalogue's misreadings; independent peers are the judge.
std::unique_ptr<Server> make_bm_tool(const catalogue::Profile& profile,
                                     const catalogue::SimulationFacts& start,
                                     const BmOptions& options);

}  // namespace spindle::sim
