#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "spindle/catalogue/profile.hpp"
#include "spindle/work/change.hpp"
#include "spindle/work/connect.hpp"

namespace spindle::work {

/// Whether what is certain of another product only may be sent.
enum class Acceptance : std::uint8_t { verified_only, unverified };

/// An action of the catalogue with the value to send.
struct ActionRequest {
  catalogue::Action action;
  std::int64_t value;
  catalogue::Secrecy secrecy = catalogue::Secrecy::open;  ///< of the register that it writes
};

/// "ACTION" or "ACTION=VALUE" (a number or a label). Errors `unknown_name` and `bad_value`, and
/// `usage` for an action that begins a motion without an end.
Result<ActionRequest> parse_action(const std::string& text, const catalogue::Profile& profile);

/// The request as it would be typed: "start", "lock=locked", "select-preset=3".
std::string words_of(const ActionRequest& request);

/// The evidence rule: what may move or lock a tool is not sent on the word of another product,
/// unless it is accepted or the tools file lists it as verified. Error `unverified` says how to
/// check it.
Result<void> check_evidence(const catalogue::Action& action, const Target& target,
                            Acceptance acceptance);

/// An action as it is sent, and what became of it.
LoggedChange logged(const ActionRequest& request);
LoggedChange logged(const ActionRequest& request, const Result<device::ActionResult>& result);

/// Carries out one action on its tool, or sends it to everybody where the target says so, with a
/// record before it and one behind it.
Result<device::ActionResult> perform_recorded(const ActionRequest& request, OpenTool& tool,
                                              ChangeLog& log, const Environment& environment);

/// The tool acknowledged the action, and its effect cannot be seen.
Error not_confirmed(const ActionRequest& request);

}  // namespace spindle::work
