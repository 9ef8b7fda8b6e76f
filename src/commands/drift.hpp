#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "comparison.hpp"

/// What is told of the tools of a group that are compared with their backups, so that a job of the
/// night can be read in the morning: each has a last line.
namespace spindle::commands {

/// The serial numbers of a tool and of its backup; each may be empty.
struct Serials {
  std::string tool;
  std::string backup;
  std::string file;  ///< the backup
};

/// Warns where they differ: the tool was exchanged, or the file is the copy of another tool's.
/// Returns what the summary of the tool says of it.
std::vector<report::Field> tell_serials(const Serials& serials, const Target& target,
                                        const Context& context);

/// The last line about a tool that could not be compared; `backup` is where its backup would be.
void tell_not_compared(const Target& target, const Error& error, const std::string& backup,
                       Context& context);

/// The last line about all `tools`. `extra` are files in the folder that are of no tool.
Summary drift_summary(const std::vector<Result<DiffResult>>& done, std::size_t tools,
                      const std::vector<std::string>& extra);

}  // namespace spindle::commands
