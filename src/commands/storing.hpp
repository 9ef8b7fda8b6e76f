#pragma once

#include "change_log.hpp"
#include "spindle/commands/commands.hpp"
#include "spindle/work/connect.hpp"

namespace spindle::commands {

/// The action by which a tool keeps what it was told beyond a power cycle.
inline constexpr std::string_view store_action = "save";

/// Refuses --save where the product stores everything by itself.
Result<void> check_storing(Storing storing, const catalogue::Profile& profile);

/// The last request of --save, told as a list of its own and recorded. A failure is noted in the
/// outcome; the result is that of the stream.
Result<void> store(OpenTool& tool, work::ChangeLog& log, Outcome& outcome, Context& context);

}  // namespace spindle::commands
