#pragma once

#include <optional>
#include <string>
#include <vector>

#include "assignment.hpp"
#include "spindle/catalogue/profile.hpp"
#include "spindle/catalogue/value.hpp"
#include "spindle/commands/commands.hpp"
#include "spindle/device/device.hpp"

namespace spindle::commands {

/// "NAME=VALUE", understood.
struct Assignment {
  catalogue::Parameter parameter;
  catalogue::Value value;
  std::string text;            ///< as typed: names of bits may mean others once the tool was read
  std::string converted = {};  ///< "1.5 kW is 1500 W"; empty: it was typed in its unit
  std::optional<ValueStep> step = std::nullopt;  ///< it has no value until the tool was read
};

/// One assignment with what the tool holds now.
struct SetStep {
  Assignment assignment;
  std::optional<catalogue::Value> before;  ///< empty: it cannot be asked

  [[nodiscard]] bool changes() const { return before != assignment.value; }
};

/// What is meant for one tool, and which tool it was.
struct SetPlan {
  std::vector<Assignment> assignments = {};
  std::vector<SetStep> steps = {};  ///< the assignments, once the tool was read
  std::string serial = {};          ///< empty: the product does not say it

  [[nodiscard]] bool changes() const;
};

/// The serial number by the tool's identity; empty: the product does not say it.
std::string serial_of(const device::Device& device);

/// Whether it is a register or a coil by its number, "@holding:4=17".
bool is_raw(const std::string& assignment);

/// "write @holding:4=17, of which it may not be known what it does"; empty where none is raw.
std::string raw_in_words(const std::vector<PlacedText>& assignments);

/// Whether the unit of torques is as the target has it, or will be told by the tool.
enum class TorqueUnit : std::uint8_t { known, told_by_tool };

/// What can be known from the profile and the target's torque unit: names, access, types, units,
/// ranges, and that none starts a motor. A torque that was typed with a unit has no value yet where
/// the tool will tell its own. Of those that stand in a file every fault is told, as one error.
Result<std::vector<Assignment>> parse_assignments(const std::vector<PlacedText>& texts,
                                                  const catalogue::Profile& profile,
                                                  const Target& target,
                                                  RawWrites raw = RawWrites::refuse,
                                                  TorqueUnit torque = TorqueUnit::known);

/// What only the tool can say: its present values, its own limits, and which bits have names. Reads
/// only. What is guarded stands behind all others.
Result<std::vector<SetStep>> check_against_tool(std::vector<Assignment> assignments,
                                                device::Device& device);

/// The plan with what the tool holds now. Reads only. Error `mismatch` where the tool is not the
/// one that was planned for, or does not hold what it held then.
Result<SetPlan> confirm_plan(const SetPlan& plan, device::Device& device);

/// What is guarded is written alone: it may change what the others mean. Error `usage`.
Result<void> check_guarded(const std::vector<Assignment>& assignments);

/// For everybody on a line. Everybody may have another setting, so only names of bits that always
/// count can be sent.
Result<std::vector<SetStep>> steps_for_everybody(std::vector<Assignment> assignments);

}  // namespace spindle::commands
