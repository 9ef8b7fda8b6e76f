#pragma once

#include <functional>
#include <string>

#include "spindle/base/error.hpp"

namespace spindle::posix {

/// Starts a second process, in a session of its own, that waits for this one. When this one ends,
/// however it ends, without having called the function that is returned, the second one does
/// `when_orphaned`, and tells what that returns on standard error (a terminal or a file), on the
/// terminal and in the system's log. Calling the function ends it; nothing is left then. It holds
/// no descriptor of this process but that, and no signal but SIGKILL ends it. Requires that no
/// other thread runs. Error `internal` when there can be no second process.
Result<std::function<void()>> start_guardian(const std::function<std::string()>& when_orphaned);

}  // namespace spindle::posix
