#pragma once

#include <string>

#include "driver.hpp"
#include "spindle/commands/commands.hpp"

namespace spindle::commands {

/// Whether one of the actions that are wanted is the search of a profile that a target has or,
/// where that is not known, may have.
bool wants_search(const DoOptions& options, const Targets& targets, const Context& context);

/// Searches on one tool for the place of its event block, and tells the lines of a profile that
/// says it. Error `usage`: it is wanted beside something else, or of several tools.
Result<Outcome> find_block(const DoOptions& options, const Targets& targets, Context& context);

/// What a list of actions has no row for, as a sentence; empty where the profile has no search.
std::string search_in_words(const catalogue::Profile& profile, const Target& target);

}  // namespace spindle::commands
