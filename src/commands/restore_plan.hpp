#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "spindle/commands/commands.hpp"
#include "spindle/files/backup_file.hpp"
#include "spindle/work/snapshot.hpp"

namespace spindle::commands {

/// Everything about one restore that is known before the first write.
struct RestoreTask {
  std::string file = {};  ///< path of the backup
  catalogue::Snapshot backup = {};
  catalogue::Snapshot present = {};
  catalogue::Selection selection = {};
  catalogue::Destination destination = catalogue::Destination::other_tool;
  catalogue::RestorePlan plan = {};
  std::vector<std::string> warnings = {};  ///< what the user should know before it
};

/// What can be known from the profile: what the backup means, and what of it is wanted.
Result<RestoreTask> plan_by_profile(const files::BackupFile& file, const RestoreOptions& options,
                                    const catalogue::Profile& profile);

/// What only the tool can say: what it holds, so what has to be written. Reads only. What is wrong
/// with single values are findings of the plan. Error `wrong_model` for the backup of another
/// model, unless it is wanted.
Result<RestoreTask> plan_by_tool(RestoreTask task, OpenTool& tool, const RestoreOptions& options,
                                 const Context& context);

/// The same plan for a tool that was opened again. Reads only. Error `mismatch` where the tool is
/// not the one that was planned for, or does not hold what it held then.
Result<RestoreTask> confirm_unchanged(const RestoreTask& task, OpenTool& tool,
                                      const RestoreOptions& options, const Context& context);

/// Whether it changes although nothing is written: what cannot be set is what the tool measures.
bool changes_by_itself(const catalogue::Parameter& parameter);

}  // namespace spindle::commands
