#include "backup_paths.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>
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
  // In a folder a file may say already what the tool holds.
  const bool may_exist = options.overwrite == Overwrite::allow || !options.folder.empty();
  if (!paths || may_exist) return paths;
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

bool says_the_same(const std::string& path, catalogue::Snapshot snapshot, const Disk& disk) {
  if (path == standard_output || !disk.exists(path)) return false;
  const auto text = disk.read(path);
  if (!text) return false;
  const auto file = files::read_backup(*text, path);
  if (!file) return false;
  snapshot.time = file->head.time;
  return files::render_backup(snapshot) == *text;
}

Error holds_another(const std::string& path) {
  return {.code = Errc::usage,
          .message = "this file is there already and does not say what the tool holds now",
          .hint = "'spindle diff' with the same --dir shows what differs; --force replaces it",
          .name = path};
}

Result<BackupPaths> paths_in_folder(const std::vector<Target>& targets, const std::string& folder) {
  return by_target(targets, folder, "would both have the backup",
                   "name the tools one by one, each with a FILE of its own");
}

Result<files::BackupFile> read_backup_of(const Target& target, const std::string& path,
                                         const std::string& folder, const Context& context) {
  auto file = read_backup_file(path, context);
  if (!file && context.disk.absent(path)) {
    file.error().hint = fmt::format("'spindle backup {} --dir {}' makes it", target.shown, folder);
  }
  return file;
}

std::vector<std::string> files_of_no_tool(const BackupPaths& paths, const std::string& folder,
                                          const Context& context) {
  std::set<std::string> known;
  for (const auto& [target, path] : paths) known.insert(path);
  for (const files::Tool& tool : context.tools.tools) {
    known.insert(path_in({.shown = tool.name}, folder));
  }
  std::vector<std::string> found;
  for (const std::string& name : context.disk.list(folder)) {
    std::string path = fmt::format("{}/{}", folder, name);
    const bool is_backup = name.ends_with(".yaml") && !name.starts_with('.');
    if (is_backup && !known.contains(path)) found.push_back(std::move(path));
  }
  std::sort(found.begin(), found.end());
  return found;
}

Result<Backups> read_backups(const std::vector<Target>& targets, const std::string& folder,
                             const Context& context) {
  TRY_LET(const auto paths, paths_in_folder(targets, folder));
  Backups backups;
  for (const Target& target : targets) {
    if (!target.fault.empty()) continue;  // told in its turn
    auto file = read_backup_of(target, paths.at(target.shown), folder, context);
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
