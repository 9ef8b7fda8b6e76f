#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "spindle/catalogue/snapshot.hpp"
#include "spindle/files/backup_file.hpp"
#include "spindle/work/connect.hpp"

namespace spindle::work {

/// Whether values that the profile calls secret are part of a snapshot.
enum class Secrets : std::uint8_t { leave_out, include };

/// The unit as shown: the tool's own torque unit where a parameter is a torque, empty when unknown.
std::string unit_of(const catalogue::Parameter& parameter, const Target& target);

/// What a tool said of itself when its registers were last checked, as files have it.
std::optional<catalogue::SnapshotIdentity> identity_of(const device::Device& device);

/// What a tool holds, and why some of it could not be read.
struct ToolSnapshot {
  catalogue::Snapshot snapshot;
  std::vector<Error> unreadable = {};
};

/// Reads everything that is stored in a tool, with its own limits.
Result<ToolSnapshot> take_snapshot(OpenTool& tool, Secrets secrets, const Environment& environment,
                                   const link::Progress& progress = {});

/// Reads a backup; its path is part of every error.
Result<files::BackupFile> read_backup_file(const std::string& path, const Environment& environment);

/// A name for a file that no target's name can lead astray: letters, digits, '.', '-' and '_' only,
/// never hidden, never a folder.
std::string file_name_of(const std::string& target);

}  // namespace spindle::work
