#pragma once

#include <memory>

#include "spindle/sim/blv_driver.hpp"
#include "spindle/sim/bm_tool.hpp"

namespace spindle::sim {

/// What the simulated tool of a profile can do. An option that asks for more would do nothing.
struct Abilities {
  bool identity = false;       ///< it answers what it is
  bool operated = false;       ///< an operator drives screws, and it may spoil what is written
  bool pushes = false;         ///< it sends frames unasked
  bool configuration = false;  ///< it configures itself, and is busy with that
  bool alarms = false;
  bool warnings = false;
};
Abilities abilities_of(const catalogue::Profile& profile);

/// The tool that a profile describes: one with an operator where it has events, a driver that
/// follows a command word, or else registers, with the motor of a command register where there is
/// one.
std::unique_ptr<Server> make_simulated_server(const catalogue::Profile& profile,
                                              const catalogue::SimulationSpec& start,
                                              const BmOptions& tool, const BlvOptions& bus);

}  // namespace spindle::sim
