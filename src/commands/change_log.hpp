#pragma once

#include <string_view>

#include "deeds.hpp"
#include "spindle/commands/target.hpp"
#include "spindle/work/change.hpp"

namespace spindle::commands {

/// The record of changes of a command on this tool. `context` must outlive it.
work::ChangeLog change_log(std::string_view command, const OpenTool& tool, const Context& context);

/// The result of an action that failed: "refused" by the tool, or "unknown" where it can not be
/// said whether it was done.
std::string_view result_of_failure(const Error& error);

/// An action as it is sent, and what became of it.
work::LoggedChange logged(const Deed& deed);
work::LoggedChange logged(const Deed& deed, const Result<device::ActionResult>& result);

/// perform_deed() with a record before it and one behind it.
Result<device::ActionResult> perform_recorded(const Deed& deed, OpenTool& tool,
                                              work::ChangeLog& log, const Context& context);

}  // namespace spindle::commands
