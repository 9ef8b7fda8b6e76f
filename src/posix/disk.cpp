#include "spindle/posix/disk.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <pwd.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <system_error>

#include "posix/descriptor.hpp"
#include "posix/reading.hpp"
#include "posix/trusted_file.hpp"
#include "posix/write_whole.hpp"
#include "spindle/posix/world.hpp"

namespace spindle::posix {
namespace {

namespace fs = std::filesystem;

constexpr mode_t private_folder = 0700;
constexpr mode_t usual_folder = 0777;
constexpr mode_t private_file = 0600;
constexpr mode_t usual_file = 0666;  // less what the user masks
/// Names of temporary files that may be taken by what a killed program left.
constexpr unsigned most_attempts = 100;

std::string hint_for(int code) {
  switch (code) {
    case ENOENT:
      return "is its folder there?";
    case EACCES:
    case EPERM:
    case EROFS:
      return "check who may read and write there";
    case ENOSPC:
    case EDQUOT:
      return "free some space, or choose another disk";
    default:
      return {};
  }
}

Error failed(Errc kind, const std::string& path, std::string_view what, int code) {
  return {.code = kind,
          .message = fmt::format("{}: {}", what, std::generic_category().message(code)),
          .hint = hint_for(code),
          .name = path};
}

Error unreadable(const std::string& path, int code) {
  return failed(Errc::bad_file, path, "cannot be read", code);
}

Error unwritable(const std::string& path, int code) {
  return failed(Errc::storage, path, "cannot be written", code);
}

Error exists_already(const std::string& path) {
  return {.code = Errc::usage,
          .message = "this file exists already",
          .hint = "choose another name, or add --force to replace it",
          .name = path};
}

Error not_a_file(Errc kind, const std::string& path) {
  return {.code = kind,
          .message = "this is no ordinary file",
          .hint = "choose another path",
          .name = path};
}

Result<std::string> read_file(const std::string& path) {
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (!file.valid()) {
    return tl::unexpected(errno == ENOENT ? Error{.code = Errc::bad_file,
                                                  .message = "no such file",
                                                  .hint = "check the path",
                                                  .name = path}
                                          : unreadable(path, errno));
  }
  struct stat about = {};
  if (::fstat(file.number(), &about) == 0 && S_ISDIR(about.st_mode)) {
    return tl::unexpected(not_a_file(Errc::bad_file, path));
  }
  // What a shell gives for <(command) is written while it is read.
  if (S_ISFIFO(about.st_mode)) static_cast<void>(::fcntl(file.number(), F_SETFL, O_RDONLY));
  std::string text;
  int code = EINTR;
  while (code == EINTR) code = read_whole(file.number(), text);
  if (code == 0) return text;
  if (code != EFBIG) return tl::unexpected(unreadable(path, code));
  return tl::unexpected(
      Error{.code = Errc::bad_file,
            .message = fmt::format("{}:1:1: larger than {} bytes; this is no file of spindle's",
                                   path, largest_file)});
}

/// A file that is removed unless it gets its name.
class TemporaryFile {
 public:
  TemporaryFile(const fs::path& beside, Privacy privacy) {
    const mode_t mode = privacy == Privacy::own ? private_file : usual_file;
    for (unsigned attempt = 0; attempt < most_attempts && !exists_; ++attempt) {
      const std::string name =
          fmt::format(".{}.{}-{}.tmp", beside.filename().string(), ::gettid(), attempt);
      path_ = (beside.parent_path() / name).string();
      file_ = Descriptor(::open(path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode));
      exists_ = file_.valid();
      if (!exists_ && errno != EEXIST) return;
    }
  }
  ~TemporaryFile() {
    if (exists_) ::unlink(path_.c_str());
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  [[nodiscard]] bool exists() const { return exists_; }

  /// 0 when the text has reached the disk, else the errno.
  [[nodiscard]] int store(std::string_view text) const {
    if (const int code = write_whole(file_.number(), text, WhenFull::fail); code != 0) return code;
    return ::fsync(file_.number()) == 0 ? 0 : errno;
  }

  /// Takes over the rights of the file that will be replaced, where there is one.
  void look_like(const fs::path& other) const {
    struct stat about = {};
    if (::stat(other.c_str(), &about) != 0) return;
    // An owner and rights that cannot be kept are no reason to fail.
    static_cast<void>(::fchown(file_.number(), about.st_uid, about.st_gid));
    static_cast<void>(::fchmod(file_.number(), about.st_mode & (S_IRWXU | S_IRWXG | S_IRWXO)));
  }

  /// 0 when it is the file of this name now, else the errno: EEXIST where one must not be replaced.
  int rename_to(const std::string& path, Overwrite overwrite) {
    const int renamed = overwrite == Overwrite::allow ? ::rename(path_.c_str(), path.c_str())
                                                      : rename_to_free(path);
    if (renamed != 0) return errno;
    exists_ = false;
    return 0;
  }

 private:
  /// Some file systems cannot rename like this, others have no hard links.
  int rename_to_free(const std::string& path) {
    const int renamed =
        ::renameat2(AT_FDCWD, path_.c_str(), AT_FDCWD, path.c_str(), RENAME_NOREPLACE);
    if (renamed == 0 || (errno != EINVAL && errno != ENOSYS)) return renamed;
    const int linked = ::link(path_.c_str(), path.c_str());
    if (linked == 0) ::unlink(path_.c_str());
    return linked;
  }

  std::string path_ = {};
  Descriptor file_ = Descriptor();
  bool exists_ = false;
};

void sync_folder(const fs::path& folder) {
  const Descriptor opened(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  // The file is in place; what a file system cannot do for its folder is no reason to fail.
  if (opened.valid()) ::fsync(opened.number());
}

Result<void> write_file(const std::string& named, std::string_view text, Overwrite overwrite,
                        Privacy privacy) {
  std::error_code unknown;
  const fs::file_status status = fs::status(named, unknown);
  if (fs::exists(status) && !fs::is_regular_file(status)) {
    return tl::unexpected(not_a_file(Errc::storage, named));
  }
  if (fs::exists(status) && overwrite == Overwrite::refuse) {
    return tl::unexpected(exists_already(named));
  }
  // A link stays a link; what it leads to is replaced.
  fs::path path = fs::exists(status) ? fs::canonical(named, unknown) : fs::absolute(named, unknown);
  if (path.empty()) path = named;
  TemporaryFile temporary(path, privacy);
  if (!temporary.exists()) return tl::unexpected(unwritable(named, errno));
  if (privacy == Privacy::usual) temporary.look_like(path);
  int code = temporary.store(text);
  if (code == 0) code = temporary.rename_to(path.string(), overwrite);
  if (code == EEXIST) return tl::unexpected(exists_already(named));
  if (code != 0) return tl::unexpected(unwritable(named, code));
  sync_folder(path.parent_path());
  return {};
}

/// Waits until no other program has the lock of a file, but never long: one that is suspended keeps
/// it. False where it has it still.
bool lock_for_a_while(const Descriptor& file, int most_tries) {
  constexpr int pause_ms = 2;
  for (int tried = 0; tried < most_tries; ++tried) {
    if (::flock(file.number(), LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK) return true;
    ::poll(nullptr, 0, pause_ms);
  }
  return false;
}

bool is_file_of_this_name(const Descriptor& file, const std::string& path) {
  struct stat opened = {};
  struct stat named = {};
  return ::fstat(file.number(), &opened) == 0 && ::stat(path.c_str(), &named) == 0 &&
         opened.st_dev == named.st_dev && opened.st_ino == named.st_ino;
}

/// The lock is one of the file and not of its name, so that the file that is replaced has to be the
/// one that was locked.
Result<bool> replace_file(const std::string& path, std::string_view expected,
                          std::string_view text) {
  constexpr int most_tries = 5000;  // a disk may be slow
  for (unsigned attempt = 0; attempt < most_attempts; ++attempt) {
    const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
    if (!file.valid()) return tl::unexpected(unreadable(path, errno));
    if (!lock_for_a_while(file, most_tries)) return tl::unexpected(unwritable(path, EBUSY));
    if (!is_file_of_this_name(file, path)) continue;  // another program has just replaced it
    TRY_LET(const auto held, read_file(path));
    if (held != expected) return false;
    return write_file(path, text, Overwrite::allow, Privacy::usual).map([] { return true; });
  }
  return tl::unexpected(unwritable(path, EBUSY));
}

/// Whether a crash or a full disk cut the last line off; one that is just being written gets its
/// end in a moment.
bool is_cut_off(const Descriptor& file) {
  constexpr int moment_ms = 5;
  if (!ends_within_line(file.number())) return false;
  ::poll(nullptr, 0, moment_ms);
  return ends_within_line(file.number());
}

Result<void> append(const std::string& path, std::string_view text,
                    bool (*begins_new_line)(const Descriptor& file)) {
  const Descriptor file(
      ::open(path.c_str(), O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC | O_NONBLOCK, usual_file));
  if (!file.valid()) return tl::unexpected(unwritable(path, errno));
  constexpr int most_tries = 50;
  static_cast<void>(lock_for_a_while(file, most_tries));
  std::string added(text);
  if (begins_new_line(file)) added.insert(added.begin(), '\n');
  const int code = write_whole(file.number(), added, WhenFull::fail);
  if (code != 0) return tl::unexpected(unwritable(path, code));
  return {};
}

Result<void> append_line(const std::string& path, std::string_view line) {
  return append(path, line, is_cut_off);
}

Result<void> append_bytes(const std::string& path, std::string_view bytes) {
  return append(path, bytes, [](const Descriptor&) { return false; });
}

Result<void> make_folders(const std::string& folder, Privacy privacy) {
  const mode_t mode = privacy == Privacy::own ? private_folder : usual_folder;
  const fs::path path(folder);
  std::error_code unknown;
  fs::path made;
  for (const fs::path& part : path) {
    made /= part;
    if (::mkdir(made.c_str(), mode) == 0 || errno == EEXIST) continue;
    const int code = errno;
    if (fs::is_directory(made, unknown)) continue;
    return tl::unexpected(failed(Errc::storage, folder, "the folder cannot be made", code));
  }
  if (fs::is_directory(path, unknown)) return {};
  return tl::unexpected(failed(Errc::storage, folder, "the folder cannot be made", ENOTDIR));
}

bool file_exists(const std::string& path) {
  std::error_code ignored;
  return std::filesystem::exists(path, ignored);
}

bool file_is_absent(const std::string& path) {
  struct stat about = {};
  return ::stat(path.c_str(), &about) != 0 &&
         (errno == ENOENT || errno == ENOTDIR || errno == ENAMETOOLONG);
}

bool is_same_file(const std::string& a, const std::string& b) {
  std::error_code unknown;
  return fs::equivalent(a, b, unknown);
}

std::string user_name() {
  passwd entry{};
  passwd* found = nullptr;
  std::array<char, 4096> text{};  // more than any name and folder need
  const int failed = ::getpwuid_r(::geteuid(), &entry, text.data(), text.size(), &found);
  return failed != 0 || found == nullptr ? std::to_string(::geteuid())
                                         : std::string(found->pw_name);
}

Disk disk_with(const Trust& trust) {
  return {
      .exists = file_exists,
      .absent = file_is_absent,
      .same_file = is_same_file,
      .list = names_in,
      .read = read_file,
      .write = write_file,
      .append_line = append_line,
      .append = append_bytes,
      .make_folders = make_folders,
      .user = user_name,
      .process = [] { return static_cast<std::uint64_t>(::getpid()); },
      .read_trusted = [trust](const std::string& path) { return read_trusted_file(path, trust); },
      .read_secret = read_secret_file,
      .replace = replace_file};
}

}  // namespace

Disk local_disk(std::string_view trusted) {
  return disk_with({.self = ::geteuid(), .others = trusted_users(trusted)});
}

Disk source_disk() { return disk_with({.self = ::geteuid(), .everyone = true}); }

}  // namespace spindle::posix
