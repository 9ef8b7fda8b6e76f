#pragma once

#include <string>
#include <string_view>

#include "spindle/commands/context.hpp"
#include "spindle/files/user_profile.hpp"
#include "spindle/work/connect.hpp"

namespace spindle::commands {

/// What a profile of the user's own begins with: `file` names it where one is to be written.
/// Errors `usage`: no profile can have this name; its folder is not there; the file is there
/// already.
Result<files::SeenOnTool> begin_user_profile(const std::string& file, const Context& context);

/// Whether a profile in `file` would find the one that it rests on. Error `usage`: only beside the
/// file of that, as the user named it. An empty `file` is not written, and so is never wrong.
Result<void> check_base(const catalogue::Profile& base, const Target& target,
                        const std::string& file, const Context& context);

/// Shows people the lines of the profile, to be saved; programs find it in a record.
Result<void> show_profile(std::string_view text, const Context& context);

/// Names the tool on which something was seen, the profile that it has, and the day.
void name_tool(const OpenTool& tool, const Clock& clock, files::SeenOnTool& seen);

}  // namespace spindle::commands
