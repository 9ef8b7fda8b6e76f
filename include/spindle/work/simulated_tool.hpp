#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "spindle/sim/simulated_tool.hpp"
#include "spindle/work/environment.hpp"

namespace spindle::work {

/// What may be chosen of a simulated tool.
struct SimulatedToolOptions {
  sim::DeviceOptions bm = {};
  std::vector<modbus::UnitId> units = {};       ///< of a serial tool; none: as many as usual
  std::optional<Duration> busy = std::nullopt;  ///< how long Configuration takes; empty: as usual
  std::vector<sim::Raised> alarms = {};
  std::vector<sim::Raised> warnings = {};       ///< of a motor driver
  std::optional<unsigned> baud = std::nullopt;  ///< of its line; empty: the profile's
};

/// Opens sim: endpoints as such tools inside this process, and everything else through the
/// environment.
device::OpenTransport with_simulated_tools(const Environment& environment,
                                           SimulatedToolOptions options);

/// A simulated tool and the profile that it was made from.
struct SimulatedTool {
  catalogue::Profile profile;
  std::unique_ptr<sim::Server> server;
};

/// How the line of a simulated serial tool is set; an empty rate is the profile's.
modbus::SerialSettings simulated_line(const catalogue::LinkSpec& facts,
                                      std::optional<unsigned> baud);

Result<SimulatedTool> make_simulated_tool(const std::string& profile,
                                          const SimulatedToolOptions& options,
                                          const Environment& environment);

}  // namespace spindle::work
