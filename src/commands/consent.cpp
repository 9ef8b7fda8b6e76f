#include "consent.hpp"

#include <fmt/format.h>

namespace spindle::commands {

Result<void> ask_consent(std::string_view what, const Context& context) {
  if (context.common.consent == Consent::given) return {};
  const bool can_ask = context.common.consent == Consent::ask && context.io.in_is_terminal &&
                       context.io.err_is_terminal;
  if (!can_ask) {
    return tl::unexpected(Error{.code = Errc::not_confirmed,
                                .message = fmt::format("{}: this has to be confirmed", what),
                                .hint = "add --yes when you are sure"});
  }
  context.io.err(fmt::format("{}. Go on? [y/N] ", what));
  const auto answer = context.io.read_line();
  if (!answer && context.interrupt.signalled()) return tl::unexpected(context.interrupt.error());
  if (answer && (*answer == "y" || *answer == "Y" || *answer == "yes")) return {};
  return tl::unexpected(Error{.code = Errc::not_confirmed,
                              .message = fmt::format("{}: not confirmed, nothing was done", what)});
}

}  // namespace spindle::commands
