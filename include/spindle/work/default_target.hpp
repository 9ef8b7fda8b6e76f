#pragma once

#include <optional>
#include <string>

#include "spindle/work/environment.hpp"

namespace spindle::work {

/// What is meant where no tool is named.
struct DefaultTarget {
  std::string text;    ///< a name, @group or URL
  std::string origin;  ///< who says so: "$SPINDLE_TARGET" or "'spindle use'"
};

/// $SPINDLE_TARGET, or else what keep_default() kept; empty: there is none. Error `bad_file` where
/// that cannot be read, or was kept with another tools file, in which the name may be another tool.
Result<std::optional<DefaultTarget>> default_target(const Environment& environment);

/// Keeps it in the user's folder of state, with the tools file that it was chosen by. Errors: where
/// it cannot be written.
Result<void> keep_default(const std::string& text, const Environment& environment);

/// Forgets what keep_default() kept. Errors: where it cannot be written.
Result<void> forget_default(const Environment& environment);

}  // namespace spindle::work
