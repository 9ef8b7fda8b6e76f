#include "seen_on_tool.hpp"

#include <fmt/format.h>

#include <filesystem>

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
  if (!context.disk.absent(file)) {
    error.message = "this file exists already";
    error.hint = "choose another name";
    return tl::unexpected(std::move(error));
  }
  return files::SeenOnTool{.id = id};
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
