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

Error go_on_as(std::string_view program, const std::vector<std::string>& arguments) {
  const std::string folder = installation().folder;
  int reason = ENOENT;
  for (const std::string_view place : {"/../libexec/spindle/", "/"}) {
    std::vector<std::string> words = {fmt::format("{}{}{}", folder, place, program)};
    words.insert(words.end(), arguments.begin(), arguments.end());
    const std::vector<char*> raw = pointers(words);
    ::execv(raw.front(), raw.data());
    if (errno != ENOENT) reason = errno;
  }
  Error error{.code = Errc::bad_file, .name = std::string(program)};
  if (reason == ENOENT) {
    error.message = "this program is not installed";
    error.hint = "install the package spindle-gateway";
  } else {
    error.message =
        fmt::format("this program cannot be run: {}", std::generic_category().message(reason));
    error.hint = "install the package spindle-gateway anew";
  }
  return error;
}

}  // namespace spindle::posix
