#pragma once

#include <string_view>

#include "listing.hpp"
#include "spindle/commands/context.hpp"
#include "spindle/work/action.hpp"

namespace spindle::commands {

/// The record of changes of a command on this tool. `context` must outlive it.
work::ChangeLog change_log(std::string_view command, const OpenTool& tool, const Context& context);

/// The summary of a command that may have changed something, with the id by which `undo` knows it.
Summary with_change(Summary summary, const work::ChangeLog& log);

}  // namespace spindle::commands
