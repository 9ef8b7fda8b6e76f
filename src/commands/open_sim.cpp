#include "open_sim.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <set>
#include <utility>

#include "spindle/sim/blv_driver.hpp"
#include "spindle/sim/bm_tool.hpp"
#include "spindle/sim/sim_transport.hpp"

namespace spindle::commands {
namespace {

/// Whom a broadcast inside the program reaches.
const std::vector<std::uint8_t> simulated_bus = {1, 2, 3};

std::vector<std::uint8_t> units_for(const link::Endpoint& endpoint,
                                    const catalogue::LinkFacts& facts) {
  const std::uint8_t unit = endpoint.unit.value_or(modbus::UnitId{facts.unit}).value;
  return unit == 0 ? simulated_bus : std::vector<std::uint8_t>{unit};
}

/// The identity has one of the lengths at which the profile says that something more begins.
Result<void> check_identity_bytes(const catalogue::Profile& profile,
                                  std::optional<std::size_t> bytes) {
  if (!bytes || !profile.identity) return {};
  const catalogue::IdentityFacts& facts = *profile.identity;
  std::set<std::size_t> known = {facts.minimum_bytes, facts.long_serial_bytes, facts.total_bytes};
  known.erase(0);
  if (known.contains(*bytes)) return {};
  return tl::unexpected(
      Error{.code = Errc::bad_value,
            .message = fmt::format("'{}' is not one of {}", *bytes, fmt::join(known, ", ")),
            .hint = fmt::format("these are the lengths of an identity that {} knows", profile.id),
            .name = "--identity-bytes"});
}

}  // namespace

Result<SimulatedTool> make_simulated_tool(const std::string& profile,
                                          const SimulatedToolOptions& options,
                                          const Context& context) {
  auto loaded = context.profiles.load(profile);
  if (!loaded) return tl::unexpected(std::move(loaded.error()));
  auto start = context.profiles.load_simulation(profile);
  if (!start) return tl::unexpected(std::move(start.error()));
  if (loaded->run) {
    auto bus = sim::make_blv_bus(*loaded, *start, {.units = options.units});
    return SimulatedTool{std::move(*loaded), std::move(bus)};
  }
  if (!loaded->events) {
    return tl::unexpected(Error{.code = Errc::usage,
                                .message = "this product can not be simulated",
                                .hint = "its profile has neither 'run' nor 'events'",
                                .name = profile});
  }
  if (auto known = check_identity_bytes(*loaded, options.identity_bytes); !known) {
    return tl::unexpected(std::move(known.error()));
  }
  auto server = sim::make_bm_tool(*loaded, *start,
                                  {.identity_bytes = options.identity_bytes,
                                   .firmware = options.firmware,
                                   .serial = options.serial,
                                   .tool_model = options.model,
                                   .faults = options.faults,
                                   .rundown_every = options.rundown_every,
                                   .ng_every = options.ng_every});
  return SimulatedTool{std::move(*loaded), std::move(server)};
}

device::OpenTransport with_simulated_tools(const Context& context, SimulatedToolOptions options) {
  return [&context, options = std::move(options)](
             const link::Endpoint& endpoint, const catalogue::LinkFacts& facts,
             Duration connect_timeout) -> Result<std::unique_ptr<link::Transport>> {
    if (endpoint.medium != link::Medium::simulated) {
      return context.open(endpoint, facts, connect_timeout);
    }
    SimulatedToolOptions here = options;
    here.units = units_for(endpoint, facts);
    auto tool = make_simulated_tool(endpoint.profile, here, context);
    if (!tool) return tl::unexpected(std::move(tool.error()));
    return sim::make_sim_transport(std::move(tool->server), tool->profile.link.framing, {},
                                   context.clock, context.interrupt);
  };
}

}  // namespace spindle::commands
