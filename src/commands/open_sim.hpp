#pragma once

#include "spindle/commands/context.hpp"

namespace spindle::commands {

/// What may be changed on a simulated tool from the command line.
struct SimulatedToolOptions {
  std::optional<std::size_t> identity_bytes = std::nullopt;
  std::optional<std::uint16_t> firmware = std::nullopt;
  std::optional<std::uint32_t> serial = std::nullopt;
  std::optional<std::uint16_t> model = std::nullopt;
  std::vector<modbus::UnitId> units = {};       ///< of a serial tool; none: as many as usual
  std::optional<unsigned> baud = std::nullopt;  ///< of its line; empty: the profile's
  sim::FaultPlan faults = {};
  std::optional<Duration> rundown_every = std::nullopt;  ///< an operator's; empty: nobody works
  unsigned ng_every = 0;  ///< every so many run-downs of the operator end NG; 0: none
  unsigned burst = 1;     ///< results that each of the operator's run-downs brings, all at once
};

/// Opens sim: endpoints as such tools inside this process, and everything else through the context.
device::OpenTransport with_simulated_tools(const Context& context, SimulatedToolOptions options);

/// A simulated tool and the profile that it was made from.
struct SimulatedTool {
  catalogue::Profile profile;
  std::unique_ptr<sim::Server> server;
};

/// How long bytes take on the line of a simulated serial tool.
Duration simulated_character_time(const catalogue::LinkFacts& facts, std::optional<unsigned> baud);

Result<SimulatedTool> make_simulated_tool(const std::string& profile,
                                          const SimulatedToolOptions& options,
                                          const Context& context);

}  // namespace spindle::commands
