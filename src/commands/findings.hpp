#pragma once

#include <string>
#include <vector>

#include "spindle/commands/context.hpp"
#include "spindle/files/finding.hpp"

namespace spindle::commands {

/// Lists what is wrong with a file: ok, and a note, when nothing is; else `bad_file` with the count
/// behind the list. `what` is "profile" or "tools file".
Result<Outcome> tell_findings(const std::vector<files::Diagnostic>& findings,
                              const std::string& name, std::string_view what, Context& context);

}  // namespace spindle::commands
