#pragma once

#include <string_view>

#include "spindle/commands/context.hpp"

namespace spindle::commands {

/// Whether a question would reach somebody: nobody is asked with --yes or --no-input, nor where
/// stdin or stderr is no terminal.
bool can_ask(const Context& context);

/// Asks before something is changed: --yes answers; on a terminal the user does; elsewhere it is
/// refused with `not_confirmed`, and the flag is named. `what` completes "… changes nothing yet:".
Result<void> ask_consent(std::string_view what, const Context& context);

/// The same for what can hardly be undone: on a terminal `word` has to be typed.
Result<void> ask_typed_consent(std::string_view what, std::string_view word,
                               const Context& context);

}  // namespace spindle::commands
