#pragma once

#include <string>

#include "description.hpp"

namespace spindle::cli {

/// `spindle --help`.
std::string program_help(const Description& description);

/// `spindle COMMAND --help`: examples first, then usage, arguments and options.
std::string command_help(const Description& description, const CommandDescription& command);

/// "-o, --output FORMAT", "    --json", "TARGET".
std::string names_of(const OptionDescription& option);

}  // namespace spindle::cli
