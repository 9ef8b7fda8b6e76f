#include "store/lock.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>

#include "spindle/base/percent.hpp"
#include "spindle/base/text.hpp"

namespace spindle::store {
namespace {

constexpr std::size_t longest_number = 20;

/// As wide as any number of a process, so that nothing of a longer one stays behind it.
constexpr std::size_t width = 10;

/// The process that wrote itself into the file; empty: it has not yet.
std::optional<std::uint64_t> holder(int file) {
  std::array<char, width> text = {};
  const ssize_t length = ::pread(file, text.data(), text.size(), 0);
  if (length <= 0) return std::nullopt;
  const std::string_view line(text.data(), static_cast<std::size_t>(length));
  return parse_unsigned(line.substr(0, line.find_first_of(" \n")),
                        std::numeric_limits<std::uint32_t>::max());
}

void tell_holder(int file) {
  const std::string line = fmt::format("{:<{}}\n", ::getpid(), width);
  // It serves the message only: a full disk is no reason to refuse.
  static_cast<void>(::pwrite(file, line.data(), line.size(), 0) == 0);
}

Error failure(const std::string& path, int number) {
  return {.code = Errc::storage,
          .message = fmt::format("cannot be locked: {}", std::generic_category().message(number)),
          .hint = "check the rights of the file and its folder, and the disk",
          .name = path};
}

std::string words_for(std::optional<std::uint64_t> process) {
  return process ? fmt::format("process {}", *process) : std::string("another process");
}

Error held(const std::string& store, std::optional<std::uint64_t> process) {
  return {.code = Errc::storage,
          .message = words_for(process) + " writes it",
          .hint = "one program writes a store: end the other one, or give another path",
          .name = store};
}

Error served(const std::string& store, const std::string& sink,
             std::optional<std::uint64_t> process) {
  return {.code = Errc::storage,
          .message = fmt::format("{} forwards to sink '{}'", words_for(process), sink),
          .hint = "one program serves a sink: end the other one first",
          .name = store};
}

std::string file_name(const std::string& sink) {
  std::string name;
  for (const char c : sink) {
    const bool is_plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
                          (c >= '0' && c <= '9') || c == '.' || c == '_' || c == '-';
    name += is_plain ? std::string(1, c) : percent_encoded(c);
  }
  return name;
}

}  // namespace

Result<std::optional<WriterLock>> WriterLock::try_to_take(const std::string& path,
                                                          std::optional<std::uint64_t>& process) {
  const int file = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, S_IRUSR | S_IWUSR);
  if (file < 0) return tl::unexpected(failure(path, errno));
  WriterLock lock(file);
  if (::flock(file, LOCK_EX | LOCK_NB) != 0) {
    const int number = errno;
    if (number != EWOULDBLOCK) return tl::unexpected(failure(path, number));
    process = holder(file);
    return std::nullopt;
  }
  tell_holder(file);
  return lock;
}

Result<WriterLock> WriterLock::take(const std::string& store) {
  std::optional<std::uint64_t> process;
  TRY_LET(auto lock, try_to_take(store + ".lock", process));
  if (!lock) return tl::unexpected(held(store, process));
  return std::move(*lock);
}

Result<WriterLock> WriterLock::take_sink(const std::string& store, const std::string& sink) {
  std::optional<std::uint64_t> process;
  TRY_LET(auto lock, try_to_take(fmt::format("{}.sink-{}.lock", store, file_name(sink)), process));
  if (!lock) return tl::unexpected(served(store, sink, process));
  return std::move(*lock);
}

WriterLock::WriterLock(WriterLock&& other) noexcept : file_(std::exchange(other.file_, -1)) {}

WriterLock::~WriterLock() {
  if (file_ >= 0) ::close(file_);
}

}  // namespace spindle::store
