#pragma once

#include <span>
#include <string>
#include <vector>

#include "spindle/commands/context.hpp"
#include "spindle/report/renderer.hpp"
#include "spindle/work/action.hpp"
#include "verb.hpp"

namespace spindle::commands {

/// Asks for consent when one of the actions has a hazard.
Result<void> ask_for_hazards(const std::vector<ActionRequest>& requests, const Target& target,
                             const Context& context);

/// What is to be done on each tool of a group.
using PlannedRequests = std::vector<Planned<std::vector<ActionRequest>>>;

/// Asks once for a whole group of `of` tools, whatever the hazard; tells first what the notes of
/// the requests say.
Result<void> ask_for_group(const PlannedRequests& planned, std::size_t of, const Context& context);

/// What the user should know before an action is carried out.
void tell_notes(const ActionRequest& request, const Target& target, const Context& context);

report::Record performed_record(const ActionRequest& request, device::ActionResult result,
                                const Target& target, const Clock& clock);
std::span<const report::Column> performed_columns();

}  // namespace spindle::commands
