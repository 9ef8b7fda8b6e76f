#include "spindle/sim/simulated_tool.hpp"

#include "bm_identity.hpp"

namespace spindle::sim {
namespace {

using catalogue::Profile;

const catalogue::MonitorFacts* monitor_of(const Profile& profile) {
  if (!profile.run) return nullptr;
  if (const auto* word = profile.run->word()) return &word->monitor;
  const auto* values = profile.run->command_register();
  return values == nullptr ? nullptr : &values->monitor;
}

bool has_command_word(const Profile& profile) {
  return profile.run && profile.run->word() != nullptr;
}

/// Of a motor events are not simulated.
bool is_screwdriver(const Profile& profile) {
  return profile.events && monitor_of(profile) == nullptr;
}

}  // namespace

Abilities abilities_of(const Profile& profile) {
  const catalogue::MonitorFacts* monitor = monitor_of(profile);
  const bool operated = is_screwdriver(profile);
  return {.identity = profile.identity && !has_command_word(profile),
          .operated = operated,
          .configuration = has_command_word(profile),
          .alarms = operated || (monitor != nullptr && !monitor->alarm.empty()),
          .warnings = monitor != nullptr && !monitor->warning.empty()};
}

std::unique_ptr<Server> make_simulated_server(const Profile& profile,
                                              const catalogue::SimulationFacts& start,
                                              const BmOptions& tool, const BlvOptions& bus) {
  if (has_command_word(profile)) return make_blv_bus(profile, start, bus);
  if (is_screwdriver(profile)) return make_bm_tool(profile, start, tool);
  return make_profile_bus(profile, start, bus, make_identity(profile.identity, start, tool));
}

}  // namespace spindle::sim
