#pragma once

#include <string>
#include <vector>

#include "restore_plan.hpp"

namespace spindle::commands {

/// Refuses the backup of another model. Error `wrong_model`.
Result<void> check_model(const RestoreTask& task, const catalogue::Profile& profile);

/// What the user should know before the restore: how the tool and its profile differ from those of
/// the backup, what the writes bring with them, and what is not written.
std::vector<std::string> warnings_for(const RestoreTask& task, const catalogue::Profile& profile);

}  // namespace spindle::commands
