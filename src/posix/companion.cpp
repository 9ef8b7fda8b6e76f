#include "spindle/posix/companion.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

#include "spindle/posix/world.hpp"

namespace spindle::posix {
namespace {

/// The words as execv() takes them; they must outlive the result.
std::vector<char*> pointers(std::vector<std::string>& words) {
  std::vector<char*> result;
  for (std::string& word : words) result.push_back(word.data());
  result.push_back(nullptr);
  return result;
}

}  // namespace

std::vector<std::string> companion_places(std::string_view program) {
  const std::string folder = installation().folder;
  return {fmt::format("{}/../libexec/spindle/{}", folder, program),
          fmt::format("{}/{}", folder, program)};
}

Error no_companion(std::string_view program, int failure) {
  Error error{.code = Errc::bad_file, .name = std::string(program)};
  if (failure == ENOENT) {
    error.message = "this program is not installed";
    error.hint = "install the package spindle-gateway";
  } else {
    error.message =
        fmt::format("this program cannot be run: {}", std::generic_category().message(failure));
    error.hint = "install the package spindle-gateway anew";
  }
  return error;
}

Error go_on_as(std::string_view program, const std::vector<std::string>& arguments) {
  int reason = ENOENT;
  for (const std::string& path : companion_places(program)) {
    std::vector<std::string> words = {path};
    words.insert(words.end(), arguments.begin(), arguments.end());
    const std::vector<char*> raw = pointers(words);
    ::execv(raw.front(), raw.data());
    if (errno != ENOENT) reason = errno;
  }
  return no_companion(program, reason);
}

}  // namespace spindle::posix
