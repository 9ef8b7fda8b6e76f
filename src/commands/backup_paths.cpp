#include "backup_paths.hpp"

#include <fmt/format.h>

#include <utility>

#include "spindle/work/snapshot.hpp"

namespace spindle::commands {
namespace {

Error bad_request(std::string message, std::string hint = {}) {
  return {.code = Errc::usage, .message = std::move(message), .hint = std::move(hint)};
}

std::string path_in(const Target& target, const std::string& folder) {
  const std::string name = file_name_of(target.shown) + ".yaml";
  return folder.empty() ? name : fmt::format("{}/{}", folder, name);
}

/// Names as files can have them are not as different as names of targets.
Result<BackupPaths> by_target(const std::vector<Target>& targets, const std::string& folder,
                              std::string_view trouble, std::string_view remedy) {
  BackupPaths paths;
  std::map<std::string, std::string> owners;
  for (const Target& target : targets) {
    std::string path = path_in(target, folder);
    const auto [owner, is_new] = owners.emplace(path, target.shown);
    if (!is_new) {
      return tl::unexpected(bad_request(
          fmt::format("'{}' and '{}' {} {}", owner->second, target.shown, trouble, path),
          std::string(remedy)));
    }
    paths.emplace(target.shown, std::move(path));
  }
  return paths;
}

}  // namespace

Result<BackupPaths> choose_paths(const std::vector<Target>& targets, const BackupOptions& options,
                                 const Context& context) {
  if (!options.file.empty() && !options.folder.empty()) {
    return tl::unexpected(bad_request("--file and --dir exclude each other", "give one of them"));
  }
  if (!options.file.empty() && targets.size() > 1) {
    return tl::unexpected(
        bad_request(fmt::format("{} tools do not fit into one file", targets.size()),
                    "--dir FOLDER writes one file a tool"));
  }
  auto paths = options.file.empty()
                   ? by_target(targets, options.folder, "would both be written to",
                               "back them up one by one, each into a --file of its own")
                   : BackupPaths{{targets.front().shown, options.file}};
  if (!paths || options.overwrite == Overwrite::allow) return paths;
  for (const Target& target : targets) {
    const std::string& path = paths->at(target.shown);
    if (path == standard_output || !context.disk.exists(path)) continue;
    Error error = bad_request("this file exists already",
                              "choose another name, or add --force to replace it");
    error.name = path;
    return tl::unexpected(std::move(error));
  }
  return paths;
}

Result<BackupPaths> paths_in_folder(const std::vector<Target>& targets, const std::string& folder) {
  return by_target(targets, folder, "would both have the backup",
                   "name the tools one by one, each with a FILE of its own");
}

Result<Backups> read_backups(const std::vector<Target>& targets, const std::string& folder,
                             const Context& context) {
  TRY_LET(const auto paths, paths_in_folder(targets, folder));
  Backups backups;
  for (const Target& target : targets) {
    auto file = read_backup_file(paths.at(target.shown), context);
    if (!file) return tl::unexpected(with_target(std::move(file.error()), target));
    backups.emplace(target.shown, std::move(*file));
  }
  return backups;
}

Result<void> check_names_only(const std::vector<std::string>& words, const Context& context) {
  for (const std::string& word : words) {
    if (!is_target(word, context) && !is_backup_file(word, context)) continue;
    return tl::unexpected(
        bad_request(fmt::format("'{}' is no parameter, and --dir says already where the backup of "
                                "each tool is",
                                word),
                    "leave out one of them"));
  }
  return {};
}

bool is_backup_file(const std::string& text, const Context& context) {
  if (is_target(text, context)) return false;
  return text.find('/') != std::string::npos || text.ends_with(".yaml") ||
         context.disk.exists(text);
}

}  // namespace spindle::commands
