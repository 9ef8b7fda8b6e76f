#include "spindle/sim/simulated_tool.hpp"

#include <algorithm>

#include "bm_identity.hpp"
#include "spindle/sim/plain_tool.hpp"

namespace spindle::sim {
namespace {

using catalogue::Profile;

const catalogue::MonitorSpec* monitor_of(const Profile& profile) {
  if (!profile.run) return nullptr;
  if (const auto* word = profile.run->word()) return &word->monitor;
  const auto* values = profile.run->command_register();
  return values == nullptr ? nullptr : &values->monitor;
}

bool has_command_word(const Profile& profile) {
  return profile.run && profile.run->word() != nullptr;
}

/// Of a motor events are not simulated.
bool is_operated(const Profile& profile) {
  return profile.events && monitor_of(profile) == nullptr;
}

bool shows_alarm(const Profile& profile) {
  return std::any_of(profile.alarm_lists.begin(), profile.alarm_lists.end(),
                     [](const catalogue::AlarmList& list) { return list.name == "present"; });
}

PlainOptions plain_options(const BmOptions& tool) {
  return {.faults = tool.faults,
          .rundown_every = tool.rundown_every,
          .ng_every = tool.ng_every,
          .burst = tool.burst,
          .alarms = tool.alarms};
}

}  // namespace

Abilities abilities_of(const Profile& profile) {
  const catalogue::MonitorSpec* monitor = monitor_of(profile);
  const bool operated = is_operated(profile);
  const bool pushes = operated && catalogue::sends_unasked(profile);
  // The identity of a tool that waits to be asked for its results is that of its start state.
  return {
      .identity = profile.identity && !has_command_word(profile) && operated == pushes,
      .operated = operated,
      .pushes = pushes,
      .configuration = has_command_word(profile),
      .alarms = operated ? shows_alarm(profile) : (monitor != nullptr && !monitor->alarm.empty()),
      .warnings = monitor != nullptr && !monitor->warning.empty()};
}

std::unique_ptr<Server> make_simulated_server(const Profile& profile,
                                              const catalogue::SimulationSpec& start,
                                              const BmOptions& tool, const BlvOptions& bus) {
  if (has_command_word(profile)) return make_blv_bus(profile, start, bus);
  if (is_operated(profile)) {
    if (catalogue::sends_unasked(profile)) return make_bm_tool(profile, start, tool);
    return make_plain_tool(profile, start, plain_options(tool));
  }
  return make_profile_bus(profile, start, bus, make_identity(profile.identity, start, tool));
}

}  // namespace spindle::sim
