#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "spindle/catalogue/profile.hpp"

namespace spindle::catalogue {

/// What a name that was typed means to a command that reads. The ending of one name is that name:
/// "1.target-torque" is preset.1.target-torque. The beginning of names is the pattern of them all:
/// "preset.1" is preset.1.*. Either ends at a point. Everything else is as it was typed: a whole
/// name, a pattern, a register, and what nothing is known of. What reading clears has no short
/// name. Error `unknown_name` with all that it may mean where an ending is one of several names.
Result<std::string> meant_by(std::string_view typed, const Profile& profile);

/// The same of each.
Result<std::vector<std::string>> meant_by(const std::vector<std::string>& typed,
                                          const Profile& profile);

/// Whether it means any parameter at all.
bool is_meant(std::string_view typed, const Profile& profile);

/// The same to a command that writes: a beginning is one name, or the error.
Result<std::string> one_meant_by(std::string_view typed, const Profile& profile);

}  // namespace spindle::catalogue
