#include "diff_side.hpp"

#include <fmt/format.h>

#include <utility>

#include "progress.hpp"
#include "spindle/work/connect.hpp"

namespace spindle::commands {
namespace {

using catalogue::Profile;

bool is_file(const std::string& text, const Context& context) {
  if (is_target(text, context)) return false;
  return text.find('/') != std::string::npos || text.ends_with(".yaml") ||
         context.disk.exists(text);
}

Result<SideContent> read_tool(const DiffSide& side, const Context& context) {
  auto profile = load_profile(*side.target, context);
  if (!profile) return tl::unexpected(std::move(profile.error()));
  auto tool = open_tool(*side.target, std::move(*profile), Need::named_registers, context);
  if (!tool) return tl::unexpected(std::move(tool.error()));
  ProgressLine progress(context);
  auto taken =
      take_snapshot(*tool, Secrets::include, context, progress.counter(side.text + ": reading"));
  if (!taken) return tl::unexpected(std::move(taken.error()));
  return SideContent{std::move(taken->snapshot), std::move(taken->unreadable),
                     tool->device.profile()};
}

Result<SideContent> read_file(const DiffSide& side, const Context& context) {
  auto profile = context.profiles.load(profile_of(side, context));
  if (!profile) return tl::unexpected(std::move(profile.error()));
  auto snapshot = files::understand_backup(*side.file, *profile);
  if (!snapshot) return tl::unexpected(std::move(snapshot.error()));
  return SideContent{std::move(*snapshot), {}, std::move(*profile)};
}

}  // namespace

Result<DiffSide> resolve_side(const std::string& text, const Context& context) {
  DiffSide side{.text = text};
  if (side.is_defaults()) return side;
  if (is_file(text, context)) {
    auto file = read_backup_file(text, context);
    if (!file) return tl::unexpected(std::move(file.error()));
    side.file = std::move(*file);
    return side;
  }
  auto target = resolve_target(text, context,
                               {.why = "each side of a comparison is one",
                                .instead = "compare them one by one, beginning with"});
  if (!target) return tl::unexpected(std::move(target.error()));
  side.target = std::move(*target);
  return side;
}

std::string profile_of(const DiffSide& side, const Context& context) {
  if (!context.common.profile.empty()) return context.common.profile;
  if (side.file) return side.file->head.profile;
  return side.target ? side.target->profile : std::string();
}

Result<SideContent> read_side(const DiffSide& side, const Context& context) {
  return side.file ? read_file(side, context) : read_tool(side, context);
}

Result<SideContent> read_defaults(const Profile& profile) {
  SideContent content{.snapshot = catalogue::snapshot_of_defaults(profile), .profile = profile};
  if (!content.snapshot.entries.empty()) return content;
  return tl::unexpected(Error{.code = Errc::usage,
                              .message = fmt::format("profile {} knows no defaults", profile.id),
                              .hint = "compare with a backup of a tool that is set right"});
}

}  // namespace spindle::commands
