#include "seen_on_tool.hpp"

#include <fmt/format.h>

#include <filesystem>

#include "spindle/base/text.hpp"
#include "spindle/files/register_map.hpp"
#include "spindle/report/record.hpp"

namespace spindle::commands {
namespace {

constexpr std::string_view usual_id = "my-tool";

/// Of "2026-11-30T12:00:00.000Z".
constexpr std::size_t date_length = 10;

}  // namespace

Result<files::SeenOnTool> begin_user_profile(const std::string& file, const Context& context) {
  if (file.empty()) return files::SeenOnTool{.id = std::string(usual_id)};
  const std::filesystem::path path(file);
  const std::string id = path.stem().string();
  Error error{.code = Errc::usage, .name = file};
  if (path.extension() != ".yaml" || !files::may_name_profile(id)) {
    error.message =
        "a profile's file is its name and '.yaml', and the name is made of lower-case "
        "words and numbers joined by '-' or '.'";
    error.hint = fmt::format("write for example {}.yaml", usual_id);
    return tl::unexpected(std::move(error));
  }
  const std::string folder = path.has_parent_path() ? path.parent_path().string() : ".";
  if (context.disk.absent(folder)) {
    error.message = fmt::format("there is no folder {}", folder);
    error.hint = "make it first, or choose another one";
    return tl::unexpected(std::move(error));
  }
  if (!context.disk.absent(file)) {
    error.message = "this file exists already";
    error.hint = "choose another name";
    return tl::unexpected(std::move(error));
  }
  return files::SeenOnTool{.id = id};
}

Result<void> check_base(const catalogue::Profile& base, const Target& target,
                        const std::string& file, const Context& context) {
  if (file.empty() || context.profiles.load(base.id.to_string())) return {};
  const std::filesystem::path folder = std::filesystem::path(target.profile).parent_path();
  if (folder == std::filesystem::path(file).parent_path()) return {};
  return tl::unexpected(
      Error{.code = Errc::usage,
            .message = fmt::format("the new profile rests on {}, which is found only beside {}",
                                   base.id, target.profile),
            .hint = fmt::format("write it there: -f {}",
                                (folder / std::filesystem::path(file).filename()).string()),
            .name = file});
}

Result<void> show_profile(std::string_view text, const Context& context) {
  if (!report::is_table(context.user.format)) return {};
  if (text.ends_with('\n')) text.remove_suffix(1);
  for (const std::string_view line : split(text, '\n')) {
    TRY(context.renderer.line({}, line));
  }
  return {};
}

void name_tool(const OpenTool& tool, const Clock& clock, files::SeenOnTool& seen) {
  seen.extends = tool.device.profile().id.to_string();
  std::string day = report::to_text(clock.wall());
  day.resize(date_length);
  const std::string& identity = tool.device.identity_text();
  seen.seen = identity.empty() ? fmt::format("{}, {}", tool.target.shown, day)
                               : fmt::format("{}, {}", identity, day);
}

}  // namespace spindle::commands
