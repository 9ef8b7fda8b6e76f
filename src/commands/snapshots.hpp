#pragma once

#include <string>
#include <vector>

#include "spindle/catalogue/snapshot.hpp"
#include "spindle/commands/commands.hpp"
#include "spindle/commands/target.hpp"
#include "spindle/files/backup_file.hpp"

namespace spindle::commands {

/// What a tool holds, and why some of it could not be read.
struct ToolSnapshot {
  catalogue::Snapshot snapshot;
  std::vector<Error> unreadable = {};
};

/// Reads everything that is stored in a tool, with its own limits.
Result<ToolSnapshot> take_snapshot(OpenTool& tool, Secrets secrets, const Context& context,
                                   const link::Progress& progress = {});

/// Reads a backup; its path is part of every error.
Result<files::BackupFile> read_backup_file(const std::string& path, const Context& context);

/// A name for a file that no target's name can lead astray: letters, digits, '.', '-' and '_' only,
/// never hidden, never a folder.
std::string file_name_of(const std::string& target);

}  // namespace spindle::commands
