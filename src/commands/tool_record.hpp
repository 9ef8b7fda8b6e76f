#pragma once

#include <string>
#include <vector>

#include "spindle/base/clock.hpp"
#include "spindle/files/tools_file.hpp"
#include "spindle/report/record.hpp"

namespace spindle::commands {

/// An entry of the tools file as the contract's `tool` record, with the groups that it is in.
report::Record tool_record(const files::Tool& tool, std::vector<std::string> groups,
                           const Clock& clock);

}  // namespace spindle::commands
