#pragma once

#include <string>
#include <vector>

#include "spindle/commands/commands.hpp"
#include "spindle/files/tools_edit.hpp"

namespace spindle::commands {

/// An entry of the tools file before it is written, and what is to be said of it.
struct NewEntry {
  files::NewTool tool;
  Target target = {};                   ///< what it means
  std::string model = {};               ///< as the tool says it; empty: unknown
  std::vector<std::string> notes = {};  ///< sentences for people
};

/// The entry as the command line says it, for the file of this path. Asks no tool. Errors:
/// `bad_target` for a URL that is none, `unknown_name` and `bad_file` for a profile that cannot be
/// used, `usage` for a tool on a serial line without one.
Result<NewEntry> entry_as_typed(const ToolAddOptions& options, const std::string& path,
                                const Context& context);

/// Asks the tool, and fills in what it says. Errors are those of reaching it, and `mismatch` where
/// it is not what the entry says, or fits no profile.
Result<void> ask_who_it_is(NewEntry& entry, const Context& context);

}  // namespace spindle::commands
