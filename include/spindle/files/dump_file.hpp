#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "spindle/base/bytes.hpp"
#include "spindle/base/error.hpp"
#include "spindle/catalogue/snapshot.hpp"

namespace spindle::files {

/// Registers side by side, as they were read.
struct DumpRun {
  modbus::RegisterTable table = modbus::RegisterTable::holding;
  std::uint16_t from = 0;
  Registers values = {};  ///< at least one
};

/// Raw registers of one tool at one moment.
struct Dump {
  std::string time = {};
  std::string version = {};  ///< of spindle
  std::string target = {};   ///< as the user named it
  std::string profile = {};  ///< empty: none was known
  std::optional<catalogue::SnapshotIdentity> identity = std::nullopt;
  std::vector<DumpRun> runs = {};
};

/// A dump as YAML, a run a line, then an end marker with the counts by which a truncated file is
/// known. The same dump always gives the same text.
std::string render_dump(const Dump& dump);

/// Whether a text says of itself that it is a dump.
bool is_dump(std::string_view text);

/// Error `bad_file` with the first fault as "file:line:column: message": no YAML, another format or
/// kind of file, truncated, unknown keys, wrong counts, and registers that stand twice or beyond
/// the last one.
Result<Dump> read_dump(std::string_view text, const std::string& path);

}  // namespace spindle::files
