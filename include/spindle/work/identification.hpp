#pragma once

#include <optional>
#include <string>
#include <vector>

#include "spindle/work/environment.hpp"

namespace spindle::work {

/// What the answer to FC 11h fits.
struct Identification {
  catalogue::Identity identity;
  /// `known` when a profile fits, `later` when only the firmware does not.
  catalogue::Generation generation = catalogue::Generation::unknown;
  std::string profile = {};                        ///< empty: unknown, or several fit
  std::vector<std::string> candidates = {};        ///< all that fit
  std::optional<catalogue::Profile> matched = {};  ///< the first of the candidates
  std::string maker = {};
  std::string series = {};
};

/// Matches an answer against all profiles, or against `only` when it is not empty.
Result<Identification> match_identity(ByteView answer, const std::string& only,
                                      const Environment& environment);

}  // namespace spindle::work
