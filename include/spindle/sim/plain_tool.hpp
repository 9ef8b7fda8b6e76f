#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "spindle/catalogue/profile.hpp"
#include "spindle/sim/fault_plan.hpp"
#include "spindle/sim/raised.hpp"
#include "spindle/sim/server.hpp"

namespace spindle::sim {

/// What `spindle simulate` and tests may change on a simulated tool without a motion of its own.
struct PlainOptions {
  /// Only those that concern the tool: ignore_write, store_other, reset_neighbour. They count
  /// accepted writes from 1.
  FaultPlan faults = {};
  /// A result at this interval, beginning one interval after the first advance(); empty: never.
  std::optional<Duration> rundown_every = std::nullopt;
  unsigned ng_every = 0;  ///< every so many of them are NG; 0: none
  unsigned burst = 1;     ///< results that come at once each time
  std::vector<Raised> alarms = {};
};

/// A simulated tool of any profile: its registers with limits and holes, its identity as far as the
/// start state has one, actions that show in the parameter that confirms them, and its events,
/// whose values the start state gives in turn.
class PlainTool : public Server {
 public:
  /// Something happens at `now`.
  virtual void happen(catalogue::EventKind kind, TimePoint now) = 0;
};

std::unique_ptr<PlainTool> make_plain_tool(const catalogue::Profile& profile,
                                           const catalogue::SimulationSpec& start,
                                           const PlainOptions& options);

}  // namespace spindle::sim
