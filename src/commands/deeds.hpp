#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "spindle/catalogue/profile.hpp"
#include "spindle/commands/commands.hpp"
#include "spindle/commands/target.hpp"
#include "spindle/report/renderer.hpp"
#include "verb.hpp"

namespace spindle::commands {

/// An action of the catalogue with the value to send.
struct Deed {
  catalogue::Action action;
  std::int64_t value;
  catalogue::Secrecy secrecy = catalogue::Secrecy::open;  ///< of the register that it writes
};

/// "ACTION" or "ACTION=VALUE" (a number or a label). Errors `unknown_name` and `bad_value`, and
/// `usage` for an action that begins a motion without an end.
Result<Deed> parse_deed(const std::string& text, const catalogue::Profile& profile);

/// The deed as it would be typed: "start", "lock=locked", "select-preset=3".
std::string words_of(const Deed& deed);

/// The evidence rule: what may move or lock a tool is not sent on the word of another product,
/// unless it is accepted or the tools file lists it as verified. Error `unverified` says how to
/// check it.
Result<void> check_evidence(const catalogue::Action& action, const Target& target,
                            Acceptance acceptance);

/// Asks for consent when one of the deeds has a hazard.
Result<void> ask_for_hazards(const std::vector<Deed>& deeds, const Target& target,
                             const Context& context);

/// What is to be done on each tool of a group.
using PlannedDeeds = std::vector<Planned<std::vector<Deed>>>;

/// Asks once for a whole group of `of` tools, whatever the hazard; tells first what the notes of
/// the deeds say.
Result<void> ask_for_group(const PlannedDeeds& planned, std::size_t of, const Context& context);

std::string_view to_text(device::ActionResult result);

/// What somebody should know before a deed is carried out.
void tell_notes(const Deed& deed, const Target& target, const Context& context);

/// Carries out one deed on its tool, or sends it to everybody where the target says so.
Result<device::ActionResult> perform_deed(const Deed& deed, OpenTool& tool, const Context& context);

report::Record deed_record(const Deed& deed, device::ActionResult result, const Target& target,
                           const Clock& clock);
std::span<const report::Column> deed_columns();

/// The tool acknowledged the deed, and its effect can not be seen.
Error not_confirmed(const Deed& deed, const Target& target);

}  // namespace spindle::commands
