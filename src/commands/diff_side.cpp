#include "diff_side.hpp"

#include <fmt/format.h>

#include <utility>

#include "backup_paths.hpp"
#include "driver.hpp"
#include "progress.hpp"
#include "spindle/work/connect.hpp"

namespace spindle::commands {

using catalogue::Profile;

Result<DiffSide> resolve_side(const std::string& text, const Context& context) {
  DiffSide side{.text = text};
  if (side.is_defaults()) return side;
  if (is_backup_file(text, context)) {
    TRY_LET(auto file, read_backup_file(text, context));
    side.file = std::move(file);
    return side;
  }
  TRY_LET(auto target,
          resolve_target(text, context,
                         {.why = "each side of a comparison is one",
                          .remedy = "--dir FOLDER compares each with its own backup in it"}));
  side.target = std::move(target);
  return side;
}

std::string profile_of(const DiffSide& side, const Context& context) {
  if (!context.common.profile.empty()) return context.common.profile;
  if (side.file) return side.file->head.profile;
  return side.target ? side.target->profile : std::string();
}

Result<SideContent> read_tool(OpenTool& tool, const Context& context) {
  ProgressLine progress(context);
  TRY_LET(auto taken, take_snapshot(tool, Secrets::include, context,
                                    progress.counter(tool.target.shown + ": reading")));
  return SideContent{std::move(taken.snapshot), std::move(taken.unreadable), tool.device.profile()};
}

Result<SideContent> read_tool(const Target& target, const Context& context) {
  auto content = load_profile(target, context).and_then([&](Profile profile) {
    return open_to_read(target, std::move(profile), context).and_then([&](OpenTool tool) {
      return read_tool(tool, context);
    });
  });
  if (!content) content.error() = with_target(std::move(content.error()), target);
  return content;
}

Result<SideContent> read_file(const DiffSide& side, const Context& context) {
  TRY_LET(auto profile, context.profiles.load(profile_of(side, context)));
  TRY_LET(auto snapshot, files::resolve_backup(*side.file, profile));
  return SideContent{std::move(snapshot), {}, std::move(profile)};
}

Result<SideContent> read_defaults(const Profile& profile) {
  SideContent content{.snapshot = catalogue::snapshot_of_defaults(profile), .profile = profile};
  if (!content.snapshot.entries.empty()) return content;
  return tl::unexpected(Error{.code = Errc::usage,
                              .message = fmt::format("profile {} knows no defaults", profile.id),
                              .hint = "compare with a backup of a tool that is set right"});
}

}  // namespace spindle::commands
