#pragma once

#include <map>
#include <string>
#include <vector>

#include "set_plan.hpp"
#include "spindle/commands/context.hpp"

namespace spindle::commands {

/// What is written to this target to take the changes back.
std::vector<PlacedText> texts_to_undo(const Undoing& undoing, const Target& target);

/// By parameter: the change of this target that is taken back.
std::map<std::string, std::string> undone_ids(const Undoing& undoing, const Target& target);

/// Whether the changes of a tool can be taken back: it is the one that they were made on, holds
/// what they left, and has its torques in the same unit. Error `mismatch`.
Result<void> check_undo(const SetPlan& plan, const Undoing& undoing, const OpenTool& tool);

/// Notes of the changes of which it is not known what they left.
void tell_doubts(const SetPlan& plan, const Undoing& undoing, const Target& target,
                 const Context& context);

}  // namespace spindle::commands
