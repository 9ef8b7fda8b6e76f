#include "open_sim.hpp"

#include <fmt/format.h>

#include <utility>

#include "spindle/sim/bm_tool.hpp"
#include "spindle/sim/sim_transport.hpp"

namespace spindle::commands {

Result<SimulatedTool> make_simulated_tool(const std::string& profile,
                                          const SimulatedToolOptions& options,
                                          const Context& context) {
  auto loaded = context.profiles.load(profile);
  if (!loaded) return tl::unexpected(std::move(loaded.error()));
  auto start = context.profiles.load_simulation(profile);
  if (!start) return tl::unexpected(std::move(start.error()));
  if (loaded->link.framing != modbus::Framing::tcp) {
    return tl::unexpected(Error{.code = Errc::usage,
                                .message = "serial tools can not be simulated by this version",
                                .name = profile});
  }
  auto server = sim::make_bm_tool(*loaded, *start,
                                  {.identity_bytes = options.identity_bytes,
                                   .firmware = options.firmware,
                                   .serial = options.serial,
                                   .tool_model = options.model,
                                   .faults = options.faults});
  return SimulatedTool{std::move(*loaded), std::move(server)};
}

device::OpenTransport with_simulated_tools(const Context& context) {
  return [&context](const link::Endpoint& endpoint, const catalogue::LinkFacts& facts,
                    Duration connect_timeout) -> Result<std::unique_ptr<link::Transport>> {
    if (endpoint.medium != link::Medium::simulated) {
      return context.open(endpoint, facts, connect_timeout);
    }
    auto tool = make_simulated_tool(endpoint.profile, {}, context);
    if (!tool) return tl::unexpected(std::move(tool.error()));
    return sim::make_sim_transport(std::move(tool->server), tool->profile.link.framing, {},
                                   context.clock, context.interrupt);
  };
}

}  // namespace spindle::commands
