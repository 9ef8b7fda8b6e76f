#include "posix/reading.hpp"

#include <dirent.h>
#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <string_view>

#include "posix/descriptor.hpp"

namespace spindle::posix {

int read_whole(int descriptor, std::string& text) {
  constexpr std::size_t read_step = 65536;  // most files are read in one piece
  std::array<char, read_step> step;         // filled as far as it is read
  while (text.size() <= largest_file) {
    const ssize_t got = ::read(descriptor, step.data(), step.size());
    if (got < 0) return errno;
    if (got == 0) return 0;
    text.append(step.data(), static_cast<std::size_t>(got));
  }
  return EFBIG;
}

std::string text_of(const std::string& path) {
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  std::string text;
  if (file.valid()) static_cast<void>(read_whole(file.number(), text));
  return text;
}

std::vector<std::string> names_in(const std::string& folder) {
  std::vector<std::string> names;
  DIR* const open = ::opendir(folder.c_str());
  if (open == nullptr) return names;
  while (const dirent* entry = ::readdir(open)) {
    const std::string_view name = entry->d_name;
    if (name != "." && name != "..") names.emplace_back(name);
  }
  ::closedir(open);
  return names;
}

}  // namespace spindle::posix
