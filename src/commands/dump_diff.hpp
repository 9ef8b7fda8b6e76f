#pragma once

#include <optional>

#include "spindle/commands/commands.hpp"
#include "spindle/files/dump_file.hpp"

namespace spindle::commands {

/// The sides of a comparison that are dumps.
struct DumpSides {
  std::optional<files::Dump> a = std::nullopt;
  std::optional<files::Dump> b = std::nullopt;

  [[nodiscard]] bool any() const { return a || b; }
};

/// Reads the files that are dumps. Whatever else a side is, or is not, is left to others.
Result<DumpSides> read_dump_sides(const DiffOptions& options, const Context& context);

/// Compares two dumps, or a dump with what the tool holds in the same registers. Error `usage`
/// where the other side is a backup or the defaults. Requires a dump.
Result<Outcome> diff_dumps(const DumpSides& sides, const DiffOptions& options, Context& context);

}  // namespace spindle::commands
