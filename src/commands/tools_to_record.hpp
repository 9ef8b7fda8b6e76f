#pragma once

#include <set>
#include <string>
#include <vector>

#include "spindle/commands/commands.hpp"
#include "watched_tool.hpp"

namespace spindle::commands {

/// Which tools a `record` is about.
struct ToolsToRecord {
  std::vector<WatchedTool> tools;
  std::vector<std::string> notes = {};  ///< of those of the tools file that cannot be recorded
};

/// Those that the options name, else all of the tools file. Asks none of them. Errors: what keeps
/// all from being recorded: a name that is wrong, lines with two settings, no tool at all. `shelf`,
/// `options` and `context` must outlive the tools.
Result<ToolsToRecord> tools_to_record(const RecordOptions& options, const files::Tools& file,
                                      ProfileShelf& shelf, const Context& context);

/// The names under which they are leased.
std::set<std::string> names_of(const std::vector<WatchedTool>& tools);

}  // namespace spindle::commands
