#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "spindle/catalogue/learning.hpp"

namespace spindle::files {

/// What was seen on a user's own tool, to be laid over the profile that it has.
struct SeenOnTool {
  std::string id;            ///< of the new profile
  std::string extends = {};  ///< of the profile that the tool has
  std::string seen = {};  ///< on which tool and when, for people: "serial 2401190042, 2026-11-30"
  /// What was seen, in sentences without line ends.
  std::vector<std::string> remarks = {};
  std::optional<std::uint16_t> event_block = std::nullopt;  ///< its first register
  struct Action {
    catalogue::LearnedAction what;
    std::uint16_t address = 0;
    std::uint16_t value = 0;  ///< of an action that takes none
  };
  std::optional<Action> action = std::nullopt;
};

/// The file of such a profile. What was seen has evidence `verified`; everything else stays as the
/// extended profile says.
std::string render_user_profile(const SeenOnTool& seen);

}  // namespace spindle::files
