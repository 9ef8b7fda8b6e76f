#pragma once

#include <string_view>

#include "spindle/commands/context.hpp"
#include "spindle/work/action.hpp"

namespace spindle::commands {

/// The record of changes of a command on this tool. `context` must outlive it.
work::ChangeLog change_log(std::string_view command, const OpenTool& tool, const Context& context);

}  // namespace spindle::commands
