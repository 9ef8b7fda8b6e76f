#include "posix/trusted_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <grp.h>
#include <pwd.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <functional>
#include <system_error>
#include <utility>

#include "posix/descriptor.hpp"
#include "posix/reading.hpp"

namespace spindle::posix {
namespace {

/// More than an entry of a usual user or group needs; a larger one counts as unknown.
constexpr std::size_t entry_size = 16384;

Error unreadable(const std::string& path, std::string message) {
  return {.code = Errc::bad_file, .message = std::move(message), .name = path};
}

Error not_opened(const std::string& path, int code) {
  if (code == ENOENT || code == ENOTDIR) return unreadable(path, "no such file");
  Error error = unreadable(path, fmt::format("the file cannot be opened for reading: {}",
                                             std::generic_category().message(code)));
  if (code == EACCES) error.hint = "check who may read it, and who may look into its folder";
  return error;
}

Account user_of(uid_t number) {
  passwd entry{};
  passwd* found = nullptr;
  std::array<char, entry_size> text{};
  const int failed = ::getpwuid_r(number, &entry, text.data(), text.size(), &found);
  if (failed != 0 || found == nullptr) return {.number = number};
  return {.number = number, .name = found->pw_name};
}

void fill_group(gid_t number, Ownership& ownership) {
  ownership.group.number = number;
  group entry{};
  group* found = nullptr;
  std::array<char, entry_size> text{};
  const int failed = ::getgrgid_r(number, &entry, text.data(), text.size(), &found);
  if (failed != 0 || found == nullptr) return;
  ownership.group.name = found->gr_name;
  for (char** member = found->gr_mem; *member != nullptr; ++member) {
    ownership.members.emplace_back(*member);
  }
}

/// Names cost a look into the system's lists, so they are asked for only where they count.
Ownership ownership_of(const struct stat& about, const Trust& trust) {
  Ownership ownership{.owner = {.number = about.st_uid},
                      .group = {.number = about.st_gid},
                      .group_writes = (about.st_mode & S_IWGRP) != 0,
                      .others_write = (about.st_mode & S_IWOTH) != 0};
  const bool plain = about.st_uid == 0 || about.st_uid == trust.self;
  if (!plain || ownership.group_writes) ownership.owner = user_of(about.st_uid);
  if (ownership.group_writes) fill_group(about.st_gid, ownership);
  return ownership;
}

/// The one who made a link chose the file behind it.
Result<void> check_link(const std::string& path, const Trust& trust) {
  struct stat about = {};
  if (::lstat(path.c_str(), &about) != 0 || !S_ISLNK(about.st_mode)) return {};
  about.st_mode &= ~static_cast<mode_t>(S_IWGRP | S_IWOTH);  // of a link they mean nothing
  return check_trust(path, ownership_of(about, trust), trust);
}

Result<void> check_secret(const std::string& path, const struct stat& about) {
  if ((about.st_mode & (S_IROTH | S_IWOTH)) == 0) return {};
  Error error = unreadable(path, "is a secret that all users of this computer can read or change");
  error.hint = fmt::format("'chmod o= {}' keeps them out", path);
  return tl::unexpected(std::move(error));
}

/// What is checked is what is read.
Result<std::string> read_checked(const std::string& path,
                                 const std::function<Result<void>(const struct stat&)>& check) {
  // To open a pipe that nothing writes into must not wait; to read from one that is slow may.
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (!file.valid()) return tl::unexpected(not_opened(path, errno));
  struct stat about = {};
  if (::fstat(file.number(), &about) != 0) return tl::unexpected(not_opened(path, errno));
  if (S_ISDIR(about.st_mode)) return tl::unexpected(unreadable(path, "is a folder, not a file"));
  TRY(check(about));
  if (S_ISFIFO(about.st_mode)) static_cast<void>(::fcntl(file.number(), F_SETFL, O_RDONLY));
  std::string text;
  switch (read_whole(file.number(), text)) {
    case 0:
      return text;
    case EINTR:
      return tl::unexpected(Error{.code = Errc::interrupted});
    case EFBIG:
      return tl::unexpected(unreadable(
          path, fmt::format("larger than {} bytes; this is no file of spindle's", largest_file)));
    default:
      return tl::unexpected(unreadable(path, "the file cannot be read"));
  }
}

}  // namespace

Result<std::string> read_trusted_file(const std::string& path, const Trust& trust) {
  TRY(check_link(path, trust));
  return read_checked(path, [&](const struct stat& about) {
    return check_trust(path, ownership_of(about, trust), trust);
  });
}

Result<std::string> read_secret_file(const std::string& path) {
  return read_checked(path, [&](const struct stat& about) { return check_secret(path, about); });
}

}  // namespace spindle::posix
