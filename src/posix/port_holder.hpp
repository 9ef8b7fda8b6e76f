#pragma once

#include <string>

namespace spindle::posix {

/// Which other program has the port open, as far as /proc tells: "minicom (process 4711)"; empty
/// when it does not. `descriptor` may be negative; then only the path is looked for.
std::string port_holder(const std::string& path, int descriptor);

}  // namespace spindle::posix
