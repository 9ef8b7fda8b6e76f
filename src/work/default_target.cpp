#include "spindle/work/default_target.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <utility>

#include "spindle/base/text.hpp"
#include "spindle/link/endpoint.hpp"

namespace spindle::work {
namespace {

constexpr std::string_view of_command = "'spindle use'";
constexpr std::string_view of_variable = "$SPINDLE_TARGET";

std::string path_of(const Environment& environment) {
  return environment.state_folder.empty() ? std::string() : environment.state_folder + "/target";
}

/// The tools file as it is found from everywhere; empty: there is none.
std::string tools_path(const Environment& environment) {
  const std::string& path = environment.tools.path;
  if (path.empty()) return {};
  std::error_code unreadable;  // then the path as it is
  const auto absolute = std::filesystem::absolute(path, unreadable);
  return (unreadable ? std::filesystem::path(path) : absolute).lexically_normal().string();
}

Error chosen_elsewhere(const std::string& text, const std::string& there, const std::string& here) {
  return {
      .code = Errc::bad_file,
      .message = fmt::format("the default target '{}' was chosen with another tools file", text),
      .hint = "name the tool, or choose again",
      .remedy = {.right = fmt::format("spindle use {}", shell_word(text))},
      .details = {fmt::format("then: {}", there.empty() ? "none" : there),
                  fmt::format("now: {}", here.empty() ? "none" : here)}};
}

Result<void> write(const std::string& text, const Environment& environment) {
  const std::string path = path_of(environment);
  if (path.empty()) {
    return tl::unexpected(
        Error{.code = Errc::storage,
              .message = "a default target cannot be kept: neither XDG_STATE_HOME nor HOME is set",
              .hint = "$SPINDLE_TARGET names one, too"});
  }
  return environment.disk.make_folders(environment.state_folder, Privacy::own).and_then([&] {
    return environment.disk.write(path, text, Overwrite::allow, Privacy::own);
  });
}

}  // namespace

Result<std::optional<DefaultTarget>> default_target(const Environment& environment) {
  if (!environment.target_variable.empty()) {
    return DefaultTarget{environment.target_variable, std::string(of_variable)};
  }
  const std::string path = path_of(environment);
  if (path.empty() || environment.disk.absent(path)) return std::nullopt;
  TRY_LET(const auto text, environment.disk.read_trusted(path));
  const auto lines = split(text, '\n');
  if (lines.front().empty()) return std::nullopt;
  DefaultTarget kept{std::string(lines.front()), std::string(of_command)};
  const std::string there(lines.size() > 1 ? lines[1] : std::string_view());
  const std::string here = tools_path(environment);
  if (link::looks_like_url(kept.text) || there == here) return kept;
  return tl::unexpected(chosen_elsewhere(kept.text, there, here));
}

Result<void> keep_default(const std::string& text, const Environment& environment) {
  return write(fmt::format("{}\n{}\n", text, tools_path(environment)), environment);
}

Result<void> forget_default(const Environment& environment) {
  const std::string path = path_of(environment);
  if (path.empty() || environment.disk.absent(path)) return {};
  return write("\n", environment);
}

}  // namespace spindle::work
