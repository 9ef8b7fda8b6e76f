#pragma once

#include "spindle/commands/commands.hpp"

namespace spindle::commands {

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
