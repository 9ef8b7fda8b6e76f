#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "spindle/commands/commands.hpp"
#include "spindle/files/backup_file.hpp"
#include "spindle/work/target.hpp"

namespace spindle::commands {

/// The name of a file that is standard output.
inline constexpr std::string_view standard_output = "-";

/// Where the backup of each target is, by the target's name.
using BackupPaths = std::map<std::string, std::string>;

/// Chooses a file for each tool. Error `usage` for all that can be known to be wrong before a tool
/// is asked: options that exclude each other, two tools in one file, and a file that exists; but in
/// a folder a file may be there, as it may say already what the tool holds.
Result<BackupPaths> choose_paths(const std::vector<Target>& targets, const BackupOptions& options,
                                 const Context& context);

/// Whether a file says the same of the tool, but for the time.
bool says_the_same(const std::string& path, catalogue::Snapshot snapshot, const Disk& disk);

/// Why a file in a folder is not written over.
Error holds_another(const std::string& path);

/// The backup of each target, by the target's name.
using Backups = std::map<std::string, files::BackupFile>;

/// Where `backup --dir` writes those of several tools. Error `usage` where two have one file.
Result<BackupPaths> paths_in_folder(const std::vector<Target>& targets, const std::string& folder);

/// Reads the one of this path that `backup --dir` wrote into this folder.
Result<files::BackupFile> read_backup_of(const Target& target, const std::string& path,
                                         const std::string& folder, const Context& context);

/// Paths of backups in a folder that are neither of these nor of a tool of the tools file, sorted.
std::vector<std::string> files_of_no_tool(const BackupPaths& paths, const std::string& folder,
                                          const Context& context);

/// Reads those that `backup --dir` wrote. The error of the first that cannot be read names its
/// tool, too.
Result<Backups> read_backups(const std::vector<Target>& targets, const std::string& folder,
                             const Context& context);

/// Refuses, beside the folder of --dir, words that are files or tools rather than names of
/// parameters. Error `usage`.
Result<void> check_names_only(const std::vector<std::string>& words, const Context& context);

/// Whether a word that is meant as a target, or as a file, is a file.
bool is_backup_file(const std::string& text, const Context& context);

}  // namespace spindle::commands
