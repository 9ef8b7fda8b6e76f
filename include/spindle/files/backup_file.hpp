#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "spindle/base/error.hpp"
#include "spindle/catalogue/snapshot.hpp"
#include "spindle/files/finding.hpp"

namespace spindle::files {

/// A snapshot as YAML: what it is of, then one parameter a line, then an end marker with the counts
/// by which a truncated file is known. The same snapshot always gives the same text.
std::string render_backup(const catalogue::Snapshot& snapshot);

/// One line of a backup as it was written.
struct BackupLine {
  std::string name;
  modbus::RegisterTable table = modbus::RegisterTable::holding;
  std::uint16_t address = 0;
  std::optional<Registers> raw = std::nullopt;
  std::optional<std::string> value = std::nullopt;
  std::string unit = {};
  std::optional<Decimal> minimum = std::nullopt;
  std::optional<Decimal> maximum = std::nullopt;
  std::optional<Decimal> step = std::nullopt;                ///< see catalogue::SnapshotEntry
  std::optional<catalogue::Missing> missing = std::nullopt;  ///< why there is no value
  SourceLocation at = {};
  SourceLocation value_at = {};
};

/// A backup file whose form is right, before it is asked what its names mean.
struct BackupFile {
  std::string path;
  catalogue::Snapshot head = {};  ///< everything but the entries
  std::vector<BackupLine> lines = {};
};

/// Reads the form. Error `bad_file` with the first fault as "file:line:column: message": no YAML,
/// another format, truncated, duplicate, missing and unknown keys, wrong types and counts.
Result<BackupFile> read_backup(std::string_view text, const std::string& path);

/// What the names and values mean. Error `bad_file` with the first fault: unknown names, registers
/// that are another parameter's, values that do not fit the encoding, and a value and raw registers
/// that say different things. Where only one of the two is there, it counts.
Result<catalogue::Snapshot> resolve_backup(const BackupFile& file,
                                           const catalogue::Profile& profile);

}  // namespace spindle::files
