#pragma once

#include <string>

namespace spindle::posix {

/// Which other program has the port open, as far as /proc tells: "minicom (process 4711)"; empty
/// when it does not. `descriptor` may be negative; then only the path is looked for.
std::string port_holder(const std::string& path, int descriptor);

/// Which other program has the port open beside this one, with or without a lock, in the same
/// words. The program behind a pseudo terminal does not count.
std::string port_company(const std::string& path);

}  // namespace spindle::posix
