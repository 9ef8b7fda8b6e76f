#include "page/recorder.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <limits>
#include <vector>

#include "spindle/base/text.hpp"

namespace spindle::page {
namespace {

/// All of a file of the system, whose size it does not say.
std::optional<std::string> contents(const char* path) {
  const int file = ::open(path, O_RDONLY | O_CLOEXEC);
  if (file < 0) return std::nullopt;
  std::string text;
  std::array<char, 4096> part = {};
  ssize_t length = 0;
  while ((length = ::read(file, part.data(), part.size())) > 0) {
    text.append(part.data(), static_cast<std::size_t>(length));
  }
  ::close(file);
  if (length < 0) return std::nullopt;
  return text;
}

std::vector<std::string_view> words_of(std::string_view line) {
  std::vector<std::string_view> words;
  for (const std::string_view word : split(line, ' ')) {
    if (!word.empty()) words.push_back(word);
  }
  return words;
}

/// "1: FLOCK ADVISORY WRITE 712 08:01:131 0 EOF"; a line of one that waits has "->" behind the
/// number.
bool names(const std::vector<std::string_view>& words, const LockedFile& file) {
  constexpr std::size_t fewest = 6;
  if (words.size() < fewest || words[1] != "FLOCK" || words[3] != "WRITE") return false;
  const std::size_t colon = words[5].rfind(':');
  if (colon == std::string_view::npos) return false;
  constexpr auto any = std::numeric_limits<std::uint64_t>::max();
  if (parse_unsigned(words[5].substr(colon + 1), any) != file.inode) return false;
  // Some file systems call their device differently here.
  const bool is_device = words[5].substr(0, colon) == file.device;
  return is_device || (file.process && parse_unsigned(words[4], any) == file.process);
}

std::optional<std::uint64_t> process_in(const std::string& path) {
  const auto text = contents(path.c_str());
  if (!text) return std::nullopt;
  return parse_unsigned(std::string_view(*text).substr(0, text->find_first_of(" \n")),
                        std::numeric_limits<std::uint32_t>::max());
}

}  // namespace

bool is_listed(std::string_view locks, const LockedFile& file) {
  for (const std::string_view line : split(locks, '\n')) {
    if (names(words_of(line), file)) return true;
  }
  return false;
}

Recorder recorder_of(const std::string& store) {
  const std::string path = store + ".lock";
  struct stat facts = {};
  if (::stat(path.c_str(), &facts) != 0) {
    return errno == ENOENT ? Recorder::stopped : Recorder::unknown;
  }
  const auto locks = contents("/proc/locks");
  if (!locks) return Recorder::unknown;
  const LockedFile file{
      .inode = facts.st_ino,
      .device = fmt::format("{:02x}:{:02x}", major(facts.st_dev), minor(facts.st_dev)),
      .process = process_in(path)};
  return is_listed(*locks, file) ? Recorder::runs : Recorder::stopped;
}

std::optional<std::uint64_t> size_of(const std::string& store) {
  struct stat facts = {};
  if (::stat(store.c_str(), &facts) != 0) return std::nullopt;
  auto bytes = static_cast<std::uint64_t>(facts.st_size);
  if (::stat((store + "-wal").c_str(), &facts) == 0) {
    bytes += static_cast<std::uint64_t>(facts.st_size);
  }
  return bytes;
}

std::optional<std::string> identity_of(const std::string& store) {
  struct statx facts = {};
  if (::statx(AT_FDCWD, store.c_str(), 0, STATX_INO | STATX_BTIME, &facts) != 0) {
    return std::nullopt;
  }
  // The number of a file that was deleted is soon given to another one.
  return fmt::format("{}:{}:{}:{}.{}", facts.stx_dev_major, facts.stx_dev_minor, facts.stx_ino,
                     facts.stx_btime.tv_sec, facts.stx_btime.tv_nsec);
}

}  // namespace spindle::page
