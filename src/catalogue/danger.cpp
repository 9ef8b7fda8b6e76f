#include "spindle/catalogue/danger.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

namespace spindle::catalogue {
namespace {

/// The gravest first.
constexpr std::array gravity = {Hazard::moves, Hazard::unclear, Hazard::locks, Hazard::link,
                                Hazard::erases};

bool is_graver(Hazard a, Hazard b) {
  return std::find(gravity.begin(), gravity.end(), a) <
         std::find(gravity.begin(), gravity.end(), b);
}

/// What an action may do; a register that acts on a change is never a mere value.
Hazard hazard_of(const Action& action) {
  if (action.motion == Motion::start) return Hazard::moves;
  const bool triggers = action.rest && action.hazard == Hazard::none;
  return triggers ? Hazard::unclear : action.hazard;
}

}  // namespace

std::string Danger::effect() const {
  if (runs_motor) return "it may start the motor";
  switch (hazard) {
    case Hazard::moves:
      return "it may start a motion";
    case Hazard::locks:
      return "it may take the tool from its operator";
    case Hazard::erases:
      return "it may erase stored settings";
    case Hazard::link:
      return "it may erase the settings of the link";
    case Hazard::unclear:
    case Hazard::none:
      break;
  }
  return "what it does is not certain, it may move or lock the tool";
}

std::string Danger::remedy() const {
  if (is_guarded) {
    return "'spindle remote-start' starts it under a guard that always ends in a stop";
  }
  if (hazard == Hazard::moves) return {};
  if (!action.empty()) return fmt::format("'spindle do TARGET {}' does it, and asks first", action);
  return {};
}

void Dangers::add(modbus::RegisterTable table, modbus::RegisterAddress address,
                  const Encoding& encoding, Danger danger) {
  if (danger.hazard == Hazard::none) return;
  const unsigned first = address.value;
  sources_.push_back({table, first, first + register_count(encoding), std::move(danger)});
}

Dangers::Dangers(const Profile& profile) {
  for (const Action& action : profile.actions) {
    add(action.table, action.address, action.encoding,
        {.hazard = hazard_of(action),
         .action = action.name,
         .is_guarded = profile.is_guarded_start(action.name)});
  }
  for (const Parameter& parameter : profile.parameters) {
    const bool runs = profile.commands_motion(parameter);
    const Danger danger{
        .hazard = runs ? Hazard::moves : parameter.hazard, .runs_motor = runs, .is_guarded = runs};
    add(parameter.table, parameter.address, parameter.encoding, danger);
    if (!parameter.write_address) continue;
    add(parameter.table, *parameter.write_address, parameter.encoding, danger);
  }
}

std::optional<Danger> Dangers::find(const Parameter& parameter) const {
  const unsigned count = register_count(parameter.encoding);
  const auto touches = [&](const Source& source, modbus::RegisterAddress address) {
    return source.table == parameter.table && source.first < address.value + count &&
           address.value < source.end;
  };
  Danger danger{.hazard = parameter.hazard};
  for (const Source& source : sources_) {
    const bool read = touches(source, parameter.address);
    if (!read && !touches(source, parameter.written_at())) continue;
    danger.runs_motor |= source.danger.runs_motor;
    danger.is_guarded |= source.danger.is_guarded;
    const bool names_action = danger.action.empty() && source.danger.hazard == danger.hazard;
    if (!names_action && !is_graver(source.danger.hazard, danger.hazard)) continue;
    danger.hazard = source.danger.hazard;
    if (!source.danger.action.empty()) danger.action = source.danger.action;
  }
  if (danger.hazard == Hazard::none) return std::nullopt;
  return danger;
}

std::optional<Danger> danger_of(const Parameter& parameter, const Profile& profile) {
  return Dangers(profile).find(parameter);
}

bool moves_without_end(const Action& action) {
  const bool by_word = action.motion != Motion::none;
  return action.hazard == Hazard::moves && !by_word && !action.stop_value;
}

}  // namespace spindle::catalogue
