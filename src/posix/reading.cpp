#include "posix/reading.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <filesystem>

#include "posix/descriptor.hpp"

namespace spindle::posix {

int read_whole(int descriptor, std::string& text) {
  constexpr std::size_t read_step = 16384;
  std::array<char, read_step> step{};
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
  std::error_code failed;
  for (std::filesystem::directory_iterator entry(folder, failed), end; !failed && entry != end;
       entry.increment(failed)) {
    names.push_back(entry->path().filename().string());
  }
  return names;
}

}  // namespace spindle::posix
