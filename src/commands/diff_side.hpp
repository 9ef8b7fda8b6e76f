#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "spindle/commands/context.hpp"
#include "spindle/work/snapshot.hpp"

namespace spindle::commands {

/// The side that is what the profile says of a new tool.
inline constexpr std::string_view factory_defaults = "defaults";

/// One side of a comparison before it is read.
struct DiffSide {
  std::string text;
  std::optional<Target> target = std::nullopt;
  std::optional<files::BackupFile> file = std::nullopt;

  [[nodiscard]] bool is_defaults() const { return text == factory_defaults; }
};

/// What the text means: the defaults, a backup file, or one tool.
Result<DiffSide> resolve_side(const std::string& text, const Context& context);

/// Profile that a side names without being asked; empty when it is not known yet.
std::string profile_of(const DiffSide& side, const Context& context);

/// What a side holds, and the profile by which it was read.
struct SideContent {
  catalogue::Snapshot snapshot;
  std::vector<Error> unreadable = {};
  catalogue::Profile profile = {};
};

/// Reads a tool that is open.
Result<SideContent> read_tool(OpenTool& tool, const Context& context);

/// Opens a tool and reads it. Every error is one of this tool.
Result<SideContent> read_tool(const Target& target, const Context& context);

/// What the backup of a side means.
Result<SideContent> read_file(const DiffSide& side, const Context& context);

/// What a profile says of a new tool. Error `usage` where it says nothing.
Result<SideContent> read_defaults(const catalogue::Profile& profile);

}  // namespace spindle::commands
