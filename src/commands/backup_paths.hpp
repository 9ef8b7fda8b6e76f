#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "spindle/commands/commands.hpp"
#include "spindle/work/target.hpp"

namespace spindle::commands {

/// The name of a file that is standard output.
inline constexpr std::string_view standard_output = "-";

/// Where the backup of each target goes, by the target's name.
using BackupPaths = std::map<std::string, std::string>;

/// Chooses a file for each tool. Error `usage` for all that can be known to be wrong before a tool
/// is asked: options that exclude each other, two tools in one file, and a file that exists.
Result<BackupPaths> choose_paths(const std::vector<Target>& targets, const BackupOptions& options,
                                 const Context& context);

}  // namespace spindle::commands
