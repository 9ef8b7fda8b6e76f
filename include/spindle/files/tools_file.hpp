#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "spindle/base/clock.hpp"
#include "spindle/base/decimal.hpp"
#include "spindle/base/disk.hpp"
#include "spindle/base/error.hpp"
#include "spindle/files/finding.hpp"
#include "spindle/files/sink.hpp"
#include "spindle/modbus/types.hpp"

namespace spindle::files {

/// Between which a joint's torque has to lie, in the tool's unit. One of the two may be missing.
struct JointLimits {
  std::optional<Decimal> lower = std::nullopt;
  std::optional<Decimal> upper = std::nullopt;
};

/// Reads "2.44:2.98", "2.44:" or ":2.98". Empty for anything else, and where the upper one is not
/// above the lower one.
std::optional<JointLimits> parse_limits(std::string_view text);

/// One named tool of the tools file (contract, section 2.1).
struct Tool {
  std::string name;
  std::string url;
  /// Empty: not given. A file whose path is relative is meant in the folder of the tools file, and
  /// stands here with that folder.
  std::string profile = {};
  std::string torque_unit = {};                         ///< empty: unknown
  std::optional<Duration> timeout = std::nullopt;       ///< for one answer; else as the URL says
  std::optional<Duration> gap = std::nullopt;           ///< silence before a request; likewise
  std::optional<std::uint32_t> retries = std::nullopt;  ///< of reads; likewise
  std::optional<modbus::TransactionIds> transactions = std::nullopt;  ///< tcp; likewise
  std::string serial = {};                          ///< whose it is; empty: not given
  std::vector<std::string> verified = {};           ///< actions that were checked on this tool
  std::map<std::int64_t, JointLimits> limits = {};  ///< of the joints, by preset
  SourceLocation url_at = {};
  SourceLocation profile_at = {};
  SourceLocation verified_at = {};
};

struct Tools {
  std::string path;  ///< empty: no file
  std::vector<Tool> tools = {};
  std::map<std::string, std::vector<std::string>> groups = {};
  /// Why not all of the file is here; only of salvage_tools().
  std::optional<Error> left_out = std::nullopt;
  std::vector<Sink> sinks = {};
  /// What is wrong with single entries, by how they are named on a command line: a tool, "@group";
  /// a sink behind "sink ". Only of usable_tools().
  std::map<std::string, Error> faults = {};
};

/// Whether a word may stand for tools of a tools file: it is a tool's name, or a group's.
bool may_name_tools(std::string_view word);

/// The file has to be trusted. Strict: unknown and duplicate keys, unknown members of groups and
/// torque units are `bad_file` with file:line:col.
Result<Tools> load_tools(const std::string& path, const Disk& disk);

/// The same, but a fault inside of the entry of a tool, group or sink is one of that entry only: it
/// stands in `faults`, and the entry must not be used.
Result<Tools> usable_tools(const std::string& path, const Disk& disk);

/// The same of a text; `path` is for messages.
Result<Tools> parse_tools(std::string_view text, const std::string& path);

/// The tools, or the first fault of one of their entries.
Result<Tools> without_faults(Tools tools);

/// A sink of these tools, or the fault of its entry.
Result<Sink> usable_sink(const Sink& sink, const Tools& tools);

/// The same for who must not be sent away to mend the file first: what can be read of it, with
/// names that are given twice as often as they are there.
Tools salvage_tools(const std::string& path, const Disk& disk);

/// What could be read of a tools file, and everything that load_tools() would refuse in it.
struct CheckedTools {
  Tools tools;
  std::vector<Diagnostic> findings;
};

/// Error only when the file cannot be read.
Result<CheckedTools> check_tools(const std::string& path, const Disk& disk);

}  // namespace spindle::files
