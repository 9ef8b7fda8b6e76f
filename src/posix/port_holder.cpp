#include "posix/port_holder.hpp"

#include <fmt/format.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>

#include <charconv>
#include <filesystem>
#include <optional>
#include <sstream>

#include "posix/reading.hpp"

namespace spindle::posix {
namespace {

namespace fs = std::filesystem;

std::string program(long process) {
  if (process == ::getpid()) return "this program itself";
  std::string name = text_of(fmt::format("/proc/{}/comm", process));
  name = name.substr(0, name.find('\n'));
  return name.empty() ? fmt::format("process {}", process)
                      : fmt::format("{} (process {})", name, process);
}

/// The process that has flocked the file behind the descriptor. A line of /proc/locks:
/// "1: FLOCK  ADVISORY  WRITE 4711 00:18:5 0 EOF".
std::optional<long> lock_holder(int descriptor) {
  struct stat status = {};
  if (::fstat(descriptor, &status) != 0) return std::nullopt;
  const std::string wanted = fmt::format("{:02x}:{:02x}:{}", ::major(status.st_dev),
                                         ::minor(status.st_dev), status.st_ino);
  std::istringstream locks(text_of("/proc/locks"));
  for (std::string line; std::getline(locks, line);) {
    std::istringstream words(line);
    std::string number;
    std::string kind;
    std::string manner;
    std::string access;
    long process = 0;
    std::string file;
    words >> number >> kind >> manner >> access >> process >> file;
    if (kind == "FLOCK" && file == wanted && process > 0) return process;
  }
  return std::nullopt;
}

/// Whether a descriptor of a process is the other end of this pseudo terminal.
bool is_other_end(const fs::path& process, const fs::path& descriptor, const fs::path& port) {
  std::istringstream info(text_of(process / "fdinfo" / descriptor));
  for (std::string line; std::getline(info, line);) {
    std::istringstream words(line);
    std::string key;
    std::string number;
    words >> key >> number;
    if (key == "tty-index:") return port.filename() == number;
  }
  return false;
}

/// Whether a process has the port open. A process that has the other end of a pseudo terminal is
/// the device behind the port, and often has the port itself open to keep it.
bool has_open(const fs::path& process, const fs::path& port) {
  const bool pseudo = port.parent_path() == "/dev/pts";
  bool found = false;
  // Other users' processes show nothing.
  for (const std::string& descriptor : names_in(process / "fd")) {
    std::error_code unreadable;
    const fs::path target = fs::read_symlink(process / "fd" / descriptor, unreadable);
    if (unreadable) continue;
    if (target == port) found = true;
    const bool multiplexer = pseudo && target.filename() == "ptmx";
    if (multiplexer && is_other_end(process, descriptor, port)) return false;
  }
  return found;
}

std::optional<long> opener(const std::string& path) {
  std::error_code failed;
  const fs::path port = fs::canonical(path, failed);
  if (failed) return std::nullopt;
  for (const std::string& name : names_in("/proc")) {
    long process = 0;
    const auto [rest, error] = std::from_chars(name.data(), name.data() + name.size(), process);
    const bool is_process = error == std::errc() && rest == name.data() + name.size();
    if (is_process && process != ::getpid() && has_open(fs::path("/proc") / name, port))
      return process;
  }
  return std::nullopt;
}

}  // namespace

std::string port_holder(const std::string& path, int descriptor) {
  auto holder = descriptor < 0 ? std::nullopt : lock_holder(descriptor);
  if (!holder) holder = opener(path);
  return holder ? program(*holder) : std::string();
}

std::string port_company(const std::string& path) {
  const auto other = opener(path);
  return other ? program(*other) : std::string();
}

}  // namespace spindle::posix
