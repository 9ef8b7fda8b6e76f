#include "posix/runtime_folder.hpp"

#include <fmt/format.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>

#include "spindle/base/hash.hpp"

namespace spindle::posix {
namespace {

constexpr const char* service_folder = "/run/spindle";
constexpr mode_t others_may_write = S_IWGRP | S_IWOTH;
constexpr mode_t for_user = S_IRUSR | S_IWUSR;
constexpr mode_t for_group = for_user | S_IRGRP | S_IWGRP;

/// Whose folder it is; empty where it is none, or another user than its owner can write there.
std::optional<uid_t> owner_of(const std::string& folder) {
  struct stat status = {};
  if (::lstat(folder.c_str(), &status) != 0) return std::nullopt;
  if (!S_ISDIR(status.st_mode) || (status.st_mode & others_may_write) != 0) return std::nullopt;
  return status.st_uid;
}

/// A folder that no other user can put a link or a file into.
bool is_own(const std::string& folder) { return owner_of(folder) == ::geteuid(); }

std::string variable(const char* name) {
  const char* const value = std::getenv(name);
  return value == nullptr ? "" : value;
}

}  // namespace

std::optional<std::string> own_runtime_folder() {
  std::string folder = fmt::format("/tmp/spindle-{}", ::geteuid());
  for (const std::string& place :
       {variable("XDG_RUNTIME_DIR"), fmt::format("/run/user/{}", ::geteuid())}) {
    if (!place.starts_with('/') || !is_own(place)) continue;
    folder = place + "/spindle";
    break;
  }
  ::mkdir(folder.c_str(), S_IRWXU);
  if (!is_own(folder)) return std::nullopt;
  return folder;
}

std::vector<OwnerFolder> owner_folders() {
  std::vector<OwnerFolder> folders;
  if (auto own = own_runtime_folder()) folders.push_back({std::move(*own), ::geteuid(), for_user});
  // Only root makes a folder in /run.
  if (const auto owner = owner_of(service_folder)) {
    folders.push_back({service_folder, *owner, for_group});
  }
  return folders;
}

std::optional<OwnerFolder> served_folder() {
  const std::string given = variable("RUNTIME_DIRECTORY");
  const std::string first = given.substr(0, given.find(':'));
  if (first.starts_with('/') && is_own(first)) return OwnerFolder{first, ::geteuid(), for_group};
  auto own = own_runtime_folder();
  if (!own) return std::nullopt;
  return OwnerFolder{std::move(*own), ::geteuid(), for_user};
}

std::optional<std::string> socket_path(const std::string& folder, const std::string& line) {
  const auto in_folder = [&](const std::string& name) {
    return fmt::format("{}/{}.sock", folder, name);
  };
  std::string name = line;
  std::replace(name.begin(), name.end(), '/', '_');
  std::string path = in_folder(name);
  constexpr std::size_t longest = sizeof(sockaddr_un::sun_path) - 1;
  if (path.size() > longest) path = in_folder(fmt::format("line-{:016x}", hash_of(line)));
  if (path.size() > longest) return std::nullopt;
  return path;
}

}  // namespace spindle::posix
