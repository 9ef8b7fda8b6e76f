#pragma once

#include <string>

#include "spindle/base/error.hpp"

namespace spindle::work {

/// The store that counts: the one that was named, else events.db in the user's folder of state.
/// Error `usage` where neither is known.
Result<std::string> store_place(const std::string& named, const std::string& state_folder);

}  // namespace spindle::work
