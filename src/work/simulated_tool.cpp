#include "spindle/work/simulated_tool.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <set>
#include <utility>

#include "spindle/sim/sim_transport.hpp"
#include "spindle/sim/simulated_tool.hpp"

namespace spindle::work {
namespace {

/// Whom a broadcast inside the program reaches.
const std::vector<modbus::UnitId> simulated_bus = {{1}, {2}, {3}};

std::vector<modbus::UnitId> units_for(const link::Endpoint& endpoint,
                                      const catalogue::LinkSpec& facts) {
  const modbus::UnitId unit = endpoint.unit.value_or(modbus::UnitId{facts.unit});
  return unit.value == 0 ? simulated_bus : std::vector<modbus::UnitId>{unit};
}

sim::DeviceOptions device_options(const SimulatedToolOptions& options) {
  sim::DeviceOptions device = options.bm;
  device.baud = options.baud.value_or(0);
  if (options.busy) device.configuring = *options.busy;
  device.alarms = options.alarms;
  device.warnings = options.warnings;
  if (options.units.empty()) return device;
  device.units.clear();
  for (const modbus::UnitId unit : options.units) device.units.push_back(unit.value);
  return device;
}

/// The identity has one of the lengths at which the profile says that something more begins.
Result<void> check_identity_bytes(const catalogue::Profile& profile,
                                  std::optional<std::size_t> bytes) {
  if (!bytes || !profile.identity) return {};
  const catalogue::IdentitySpec& facts = *profile.identity;
  std::set<std::size_t> known = {facts.minimum_bytes, facts.long_serial_bytes, facts.total_bytes};
  known.erase(0);
  if (known.contains(*bytes)) return {};
  return tl::unexpected(
      Error{.code = Errc::bad_value,
            .message = fmt::format("'{}' is not one of {}", *bytes, fmt::join(known, ", ")),
            .hint = fmt::format("these are the lengths of an identity that {} knows", profile.id),
            .name = "--identity-bytes"});
}

/// The state machine for this kind of tool.
Result<std::unique_ptr<sim::Server>> make_server(const catalogue::Profile& profile,
                                                 const catalogue::SimulationSpec& start,
                                                 const SimulatedToolOptions& options) {
  TRY(check_identity_bytes(profile, options.bm.identity_bytes));
  return sim::make_simulated_bus(profile, start, device_options(options));
}

}  // namespace

Result<SimulatedTool> make_simulated_tool(const std::string& profile,
                                          const SimulatedToolOptions& options,
                                          const Environment& environment) {
  TRY_LET(auto loaded, environment.profiles.load(profile));
  TRY_LET(auto start, environment.profiles.load_simulation(profile));
  TRY_LET(auto server, make_server(loaded, start, options));
  return SimulatedTool{std::move(loaded), std::move(server)};
}

modbus::SerialSettings simulated_line(const catalogue::LinkSpec& facts,
                                      std::optional<unsigned> baud) {
  return link::serial_settings({.baud = baud}, facts.serial.line);
}

device::OpenTransport with_simulated_tools(const Environment& environment,
                                           SimulatedToolOptions options) {
  return [&environment, options = std::move(options)](
             const link::Endpoint& endpoint, const catalogue::LinkSpec& facts,
             Duration connect_timeout) -> Result<std::unique_ptr<link::Transport>> {
    if (endpoint.medium != link::Medium::simulated) {
      return environment.open(endpoint, facts, connect_timeout);
    }
    SimulatedToolOptions wanted = options;
    wanted.baud = endpoint.baud;
    wanted.units = units_for(endpoint, facts);
    TRY_LET(auto tool, make_simulated_tool(endpoint.profile, wanted, environment));
    return sim::make_sim_transport(
        std::move(tool.server), tool.profile.link.framing, {}, environment.clock,
        environment.interrupt,
        {.character_time = character_time(simulated_line(tool.profile.link, endpoint.baud))});
  };
}

}  // namespace spindle::work
