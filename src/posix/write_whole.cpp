#include "posix/write_whole.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <string>

#include "posix/descriptor.hpp"

namespace spindle::posix {
namespace {

/// Size of an ordinary file; negative for anything else.
off_t size_of(int descriptor) {
  struct stat about = {};
  const bool is_file = ::fstat(descriptor, &about) == 0 && S_ISREG(about.st_mode);
  return is_file ? about.st_size : -1;
}

/// The last `written` bytes of a file, unless they are not the last any more.
void take_back(int descriptor, std::size_t written) {
  if (written == 0) return;
  const off_t end = ::lseek(descriptor, 0, SEEK_CUR);
  if (end < 0 || size_of(descriptor) != end) return;
  const off_t begin = end - static_cast<off_t>(written);
  if (::ftruncate(descriptor, begin) == 0) ::lseek(descriptor, begin, SEEK_SET);
}

/// A byte of a file that may be open for writing only.
char byte_at(int descriptor, off_t place, char otherwise) {
  const std::string path = fmt::format("/proc/self/fd/{}", descriptor);
  const Descriptor readable(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  char byte = otherwise;
  const bool known = readable.valid() && ::pread(readable.number(), &byte, 1, place) == 1;
  return known ? byte : otherwise;
}

}  // namespace

int write_whole(int descriptor, std::string_view text, WhenFull when_full) {
  std::size_t done = 0;
  while (done < text.size()) {
    const ssize_t written = ::write(descriptor, text.data() + done, text.size() - done);
    if (written >= 0) {
      done += static_cast<std::size_t>(written);
    } else if (errno == EAGAIN && when_full == WhenFull::wait) {
      // A terminal or pipe shared with a program that made it non-blocking.
      pollfd room = {descriptor, POLLOUT, 0};
      ::poll(&room, 1, -1);
    } else if (errno != EINTR) {
      const int failure = errno;
      take_back(descriptor, done);
      return failure;
    }
  }
  return 0;
}

bool ends_within_line(int descriptor) {
  const off_t size = size_of(descriptor);
  if (size <= 0) return false;
  const int flags = ::fcntl(descriptor, F_GETFL);
  const bool appends = flags != -1 && (flags & O_APPEND) != 0;
  const off_t place = appends ? size : ::lseek(descriptor, 0, SEEK_CUR);
  return place > 0 && place <= size && byte_at(descriptor, place - 1, '\n') != '\n';
}

}  // namespace spindle::posix
