#include "backup_paths.hpp"

#include <fmt/format.h>

#include <utility>

#include "spindle/work/snapshot.hpp"

namespace spindle::commands {
namespace {

Error bad_request(std::string message, std::string hint = {}) {
  return {.code = Errc::usage, .message = std::move(message), .hint = std::move(hint)};
}

std::string path_of(const Target& target, const BackupOptions& options) {
  if (!options.file.empty()) return options.file;
  const std::string name = file_name_of(target.shown) + ".yaml";
  return options.folder.empty() ? name : fmt::format("{}/{}", options.folder, name);
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
  BackupPaths paths;
  std::map<std::string, std::string> owners;
  for (const Target& target : targets) {
    std::string path = path_of(target, options);
    const auto [owner, is_new] = owners.emplace(path, target.shown);
    if (!is_new) {
      return tl::unexpected(bad_request(fmt::format("'{}' and '{}' would both be written to {}",
                                                    owner->second, target.shown, path),
                                        "back them up one by one, each into a --file of its own"));
    }
    const bool taken = path != standard_output && context.disk.exists(path);
    if (taken && options.overwrite == Overwrite::refuse) {
      Error error = bad_request("this file exists already",
                                "choose another name, or add --force to replace it");
      error.name = path;
      return tl::unexpected(std::move(error));
    }
    paths.emplace(target.shown, std::move(path));
  }
  return paths;
}

}  // namespace spindle::commands
