#pragma once

#include <string>

#include "spindle/commands/context.hpp"
#include "spindle/files/user_profile.hpp"
#include "spindle/work/connect.hpp"

namespace spindle::commands {

/// What a profile of the user's own begins with: `file` names it where one is to be written.
/// Errors `usage`: no profile can have this name; the file is there already.
Result<files::SeenOnTool> begin_user_profile(const std::string& file, const Context& context);

/// Names the tool on which something was seen, the profile that it has, and the day.
void name_tool(const OpenTool& tool, const Clock& clock, files::SeenOnTool& seen);

}  // namespace spindle::commands
