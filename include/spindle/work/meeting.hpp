#pragma once

#include <optional>

#include "spindle/work/connect.hpp"
#include "spindle/work/identification.hpp"

namespace spindle::work {

/// Who is there, as far as one exchange tells it.
struct Meeting {
  Identification found = {};
  Duration round_trip = {};
  bool is_proven = true;  ///< false: it answers, and its profile is what the user named
  std::optional<Error> misfit = std::nullopt;  ///< it is not what the target's profile describes
};

/// Asks a tool who it is, and touches nothing. A product without an identity can only be met: what
/// is asked then is what its line knows, else its first parameter. Error `usage` for a tool on a
/// serial line whose profile was not named.
Result<Meeting> meet(OpenTool& tool, const Environment& environment);

}  // namespace spindle::work
