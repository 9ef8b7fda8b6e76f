#pragma once

#include <vector>

#include "spindle/commands/commands.hpp"
#include "spindle/commands/target.hpp"

namespace spindle::commands {

/// Sets the same parameters on several tools: all are read and checked before the first write, one
/// question stands for all, and each is opened again to be written if it still is as it was shown.
/// Nobody's line is held while somebody thinks about the question.
Result<Outcome> set_group(const std::vector<Target>& targets, const SetOptions& options,
                          Context& context);

}  // namespace spindle::commands
