#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "spindle/base/error.hpp"

namespace spindle::posix {

/// Goes on as another program of this installation with these arguments: from
/// ../libexec/spindle beside the folder of this program, or from that folder itself (a build).
/// Returns only where that fails: `bad_file`, when the program is not installed or cannot be run.
Error go_on_as(std::string_view program, const std::vector<std::string>& arguments);

/// The paths under which it may be, the better ones first.
std::vector<std::string> companion_places(std::string_view program);

/// Why it could not be run; `failure` as errno tells it.
Error no_companion(std::string_view program, int failure);

}  // namespace spindle::posix
