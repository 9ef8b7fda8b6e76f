#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "spindle/catalogue/profile.hpp"
#include "spindle/sim/fault_plan.hpp"
#include "spindle/sim/raised.hpp"
#include "spindle/sim/server.hpp"

namespace spindle::sim {

/// What `spindle simulate` and tests may change on a simulated BM/BMT.
struct BmOptions {
  std::optional<std::size_t> identity_bytes =
      std::nullopt;  ///< 12, 13 or 17; default: the profile's
  std::optional<std::uint16_t> firmware = std::nullopt;
  std::optional<std::uint32_t> serial =
      std::nullopt;  ///< as printed, in every form of the identity
  std::optional<std::uint16_t> tool_model = std::nullopt;
  /// Only those that concern the tool: ignore_write, store_other, reset_neighbour. They count
  /// accepted writes from 1.
  FaultPlan faults = {};
  /// An operator who runs down a screw at this interval, beginning one interval after the first
  /// advance(); empty: no operator.
  std::optional<Duration> rundown_every = std::nullopt;
  unsigned ng_every = 0;  ///< every so many of the operator's run-downs end NG; 0: none
  std::vector<Raised> alarms = {};
  unsigned burst = 1;  ///< results that each of the operator's run-downs brings, all at once
};

/// How a run-down by the tool's own trigger ends: at the target, or released before it.
enum class Rundown : std::uint8_t { ok, ng };

/// A simulated BM/BMT screwdriver: parameters 1–725 with holes and MIN/MAX mirrors, live status,
/// last event, remote inputs with the sibling's mapping, a run-down with ramping torque, alarms,
/// auto output that expires, identity. All registers, scales and start values come from the
/// profile, so it shares the catalogue's misreadings; independent peers are the judge.
class BmTool : public Server {
 public:
  /// The operator pulls the trigger at `now`. Ignored while the tool runs, is locked or has an
  /// alarm.
  virtual void operator_rundown(Rundown outcome, TimePoint now) = 0;

  /// A fault occurs: a run ends, `error` is sent as event, starts are ignored until the reset.
  virtual void raise_alarm(std::uint16_t code, TimePoint now) = 0;

  /// No motion, alarm, lock or armed output; events count from 0 again. Stored parameters stay.
  void reboot(TimePoint now) override = 0;
};

/// Requires a profile with events.
std::unique_ptr<BmTool> make_bm_tool(const catalogue::Profile& profile,
                                     const catalogue::SimulationSpec& start,
                                     const BmOptions& options);

}  // namespace spindle::sim
