#pragma once

#include "spindle/commands/context.hpp"

namespace spindle::commands {

/// What may be changed on a simulated tool from the command line.
struct SimulatedToolOptions {
  std::optional<std::size_t> identity_bytes = std::nullopt;
  std::optional<std::uint16_t> firmware = std::nullopt;
  std::optional<std::uint32_t> serial = std::nullopt;
  std::optional<std::uint16_t> model = std::nullopt;
  sim::FaultPlan faults = {};
  std::optional<Duration> rundown_every = std::nullopt;  ///< an operator's; empty: nobody works
  std::vector<std::uint8_t> units = {1};                 ///< addresses on a simulated line
  unsigned ng_every = 0;  ///< every so many run-downs of the operator end NG; 0: none
};

/// Opens sim: endpoints as such tools inside this process, and everything else through the context.
device::OpenTransport with_simulated_tools(const Context& context, SimulatedToolOptions options);

/// A simulated tool and the profile that it was made from.
struct SimulatedTool {
  catalogue::Profile profile;
  std::unique_ptr<sim::Server> server;
};

Result<SimulatedTool> make_simulated_tool(const std::string& profile,
                                          const SimulatedToolOptions& options,
                                          const Context& context);

}  // namespace spindle::commands
