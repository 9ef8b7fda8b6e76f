#include "spindle/sim/simulated_tool.hpp"

#include <algorithm>

#include "blv_unit.hpp"
#include "bm_unit.hpp"
#include "bus.hpp"
#include "gen2_unit.hpp"
#include "identity.hpp"
#include "profile_unit.hpp"

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

/// It has a motor that is started by the action that a screwdriver has, and sends its results
/// unasked.
bool is_screwdriver(const Profile& profile) {
  return catalogue::sends_unasked(profile) && profile.find_action("start").has_value();
}

bool shows_alarm(const Profile& profile) {
  const auto* start = profile.run ? profile.run->action() : nullptr;
  if (start != nullptr && !start->alarm.empty()) return true;
  return std::any_of(profile.alarm_lists.begin(), profile.alarm_lists.end(),
                     [](const catalogue::AlarmList& list) { return list.name == "present"; });
}

/// What no event of a tool with this firmware has is not there.
catalogue::SimulationSpec with_its_events(const Profile& profile,
                                          const catalogue::SimulationSpec& start,
                                          const DeviceOptions& options) {
  if (profile.events->longer.empty()) return start;
  catalogue::SimulationSpec fitting = start;
  const unsigned firmware = firmware_of(profile.identity, start, options);
  const unsigned count = profile.events->count_for(firmware);
  std::vector<catalogue::Area> absent(start.absent.begin(), start.absent.end());
  for (const catalogue::EventForm& form : profile.events->longer) {
    if (form.count <= count) continue;
    absent.push_back({.table = table_of(*profile.events),
                      .from = static_cast<std::uint16_t>(*profile.events->first + count),
                      .to = static_cast<std::uint16_t>(*profile.events->first + form.count - 1)});
  }
  fitting.absent = std::move(absent);
  return fitting;
}

}  // namespace

Abilities abilities_of(const Profile& profile) {
  const catalogue::MonitorSpec* monitor = monitor_of(profile);
  const bool is_operated = profile.events || is_gen2(profile);
  return {
      .identity = profile.identity.has_value(),
      .operated = is_operated,
      .pushes = catalogue::sends_unasked(profile) || is_gen2(profile),
      .dated = is_gen2(profile),
      .configuration = has_command_word(profile),
      .alarms = monitor == nullptr ? is_operated && shows_alarm(profile) : !monitor->alarm.empty(),
      .warnings = monitor != nullptr && !monitor->warning.empty()};
}

std::unique_ptr<SimulatedBus> make_simulated_bus(const Profile& profile,
                                                 const catalogue::SimulationSpec& start,
                                                 const DeviceOptions& options) {
  return make_bus(profile, options, [&](std::uint8_t address) -> std::unique_ptr<Unit> {
    if (has_command_word(profile)) {
      return std::make_unique<BlvUnit>(profile, start, address, options);
    }
    if (is_gen2(profile)) return std::make_unique<Gen2Unit>(profile, start, address, options);
    if (is_screwdriver(profile)) {
      return std::make_unique<BmUnit>(profile, with_its_events(profile, start, options), address,
                                      options);
    }
    return std::make_unique<ProfileUnit>(profile, start, address, options);
  });
}

}  // namespace spindle::sim
