#include "posix/line_lock.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <optional>

#include "posix/port_holder.hpp"

namespace spindle::posix {
namespace {

/// A folder that nobody else can put a link or a file into.
bool is_own(const std::string& folder) {
  struct stat status = {};
  if (::lstat(folder.c_str(), &status) != 0) return false;
  constexpr mode_t others_may_write = S_IWGRP | S_IWOTH;
  return S_ISDIR(status.st_mode) && status.st_uid == ::geteuid() &&
         (status.st_mode & others_may_write) == 0;
}

/// The same for every program of the user, whatever its environment.
std::optional<std::string> lock_folder() {
  std::string folder = fmt::format("/tmp/spindle-{}", ::geteuid());
  const char* runtime = std::getenv("XDG_RUNTIME_DIR");
  for (const std::string& place :
       {std::string(runtime == nullptr ? "" : runtime), fmt::format("/run/user/{}", ::geteuid())}) {
    if (!place.starts_with('/') || !is_own(place)) continue;
    folder = place + "/spindle";
    break;
  }
  ::mkdir(folder.c_str(), S_IRWXU);
  if (!is_own(folder)) return std::nullopt;
  return folder;
}

}  // namespace

LineLock lock_line(const std::string& name) {
  const auto folder = lock_folder();
  if (!folder) return {};
  std::string file = name;
  std::replace(file.begin(), file.end(), '/', '_');
  const std::string path = fmt::format("{}/{}.lock", *folder, file);
  Descriptor lock(
      ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, S_IRUSR | S_IWUSR));
  if (!lock.valid()) return {};
  if (::flock(lock.number(), LOCK_EX | LOCK_NB) == 0) return {.file = std::move(lock)};
  if (errno != EWOULDBLOCK) return {};
  std::string holder = port_holder(path, lock.number());
  return {.holder = holder.empty() ? "another program" : std::move(holder)};
}

}  // namespace spindle::posix
