#pragma once

#include <functional>
#include <string>

#include "spindle/base/error.hpp"

namespace spindle::files {

/// How the text of a profile or tools file is had; error `bad_file` says why it is not.
using ReadText = std::function<Result<std::string>(const std::string& path)>;

/// Reads a whole file, whichever user can change it. Error `bad_file` when it cannot be read or is
/// larger than any file of ours.
Result<std::string> read_text_file(const std::string& path);

}  // namespace spindle::files
