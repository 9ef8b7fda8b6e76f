#pragma once

#include <string_view>

#include "spindle/commands/context.hpp"
#include "spindle/work/connect.hpp"

namespace spindle::commands {

/// Whether a question would reach a user: none is asked with --yes or --no-input, nor where
/// stdin or stderr is no terminal.
bool can_ask(const Context& context);

/// Asks before something is changed: --yes answers; on a terminal the user does; elsewhere it is
/// refused with `not_confirmed`, and the flag is named. `what` completes "… changes nothing yet:".
Result<void> ask_consent(std::string_view what, const Context& context);

/// Refuses as ask_consent() does where no user can be asked; asks nothing. For a command that has
/// to look at a tool before the question can be put.
Result<void> require_answer(std::string_view what, const Context& context);

/// Asks about a tool that was looked at, which --yes does not answer. The tool is let go while the
/// question stands, as a person may take their time, and opened anew behind it. Error `mismatch`
/// where another tool answers then.
Result<void> ask_away_from(OpenTool& tool, std::string_view what, const Context& context);

/// The same for what can hardly be undone: on a terminal `word` has to be typed.
Result<void> ask_typed_consent(std::string_view what, std::string_view word,
                               const Context& context);

}  // namespace spindle::commands
