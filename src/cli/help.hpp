#pragma once

#include <string>
#include <vector>

#include "description.hpp"

namespace spindle::cli {

/// `spindle --help`.
std::string program_help(const Description& description);

/// `spindle COMMAND --help`: examples first, then usage, arguments and its own options, on 25 lines
/// of 100 columns. Options that have no room there are named, and the manual explains them.
std::string command_help(const CommandDescription& command);

/// Options of the command that its help only names.
std::vector<OptionDescription> left_to_manual(const CommandDescription& command);

/// "-o, --output FORMAT", "    --json", "TARGET".
std::string names_of(const OptionDescription& option);

}  // namespace spindle::cli
