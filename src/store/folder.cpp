#include "store/folder.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/magic.h>
#include <sys/stat.h>
#include <sys/vfs.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <system_error>

namespace spindle::store {
namespace {

Error failure(const std::string& path, std::string_view what, int number) {
  return {.code = Errc::storage,
          .message = fmt::format("{}: {}", what, std::generic_category().message(number)),
          .hint = "check the rights of the folder, and the disk",
          .name = path};
}

/// A write-ahead log needs memory that all who open it share.
Result<void> check_file_system(const std::string& folder, const std::string& path) {
  struct statfs status = {};
  if (::statfs(folder.c_str(), &status) != 0) return {};
  // The type is signed, and wider on some machines.
  const auto magic = static_cast<std::uint32_t>(status.f_type);
  const std::string_view network = network_file_system(magic);
  if (network.empty()) return {};
  return tl::unexpected(
      Error{.code = Errc::storage,
            .message = fmt::format("is on a network file system ({}), which cannot hold a store: "
                                   "its write-ahead log needs memory that is shared",
                                   network),
            .hint = "use a disk of this computer",
            .name = path});
}

}  // namespace

std::string_view network_file_system(std::int64_t magic) {
  constexpr std::int64_t cifs = 0xFF534D42;
  constexpr std::int64_t smb2 = 0xFE534D42;
  switch (magic) {
    case NFS_SUPER_MAGIC:
      return "NFS";
    case SMB_SUPER_MAGIC:
    case cifs:
    case smb2:
      return "SMB";
    case AFS_SUPER_MAGIC:
      return "AFS";
    default:
      return {};
  }
}

Result<void> prepare_folder(const std::string& path) {
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) {
    return tl::unexpected(failure(folder.string(), "the folder cannot be made", error.value()));
  }
  return check_file_system(folder.string(), path);
}

Result<void> make_own_file(const std::string& path, Errc there) {
  const int file = ::open(path.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, S_IRUSR | S_IWUSR);
  if (file >= 0) {
    ::close(file);
    return {};
  }
  if (errno != EEXIST) return tl::unexpected(failure(path, "cannot be made", errno));
  return tl::unexpected(Error{.code = there, .message = "is there already", .name = path});
}

}  // namespace spindle::store
