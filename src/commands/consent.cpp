#include "consent.hpp"

#include <fmt/format.h>

namespace spindle::commands {

bool can_ask(const Context& context) {
  return context.common.consent == Consent::ask && context.io.in_is_terminal &&
         context.io.err_is_terminal;
}

namespace {

/// What the user typed; empty: --yes answers.
Result<std::optional<std::string>> ask(std::string_view what, std::string_view question,
                                       const Context& context) {
  if (context.common.consent == Consent::given) return std::nullopt;
  if (!can_ask(context)) {
    return tl::unexpected(Error{.code = Errc::not_confirmed,
                                .message = fmt::format("{}: this has to be confirmed", what),
                                .hint = "add --yes when you are sure"});
  }
  context.io.err(fmt::format("{}. {} ", what, question));
  const auto answer = context.io.read_line();
  if (answer) return *answer;
  context.io.err("\n");  // behind a question that nobody answered, the terminal's line goes on
  if (context.interrupt.signalled()) return tl::unexpected(context.interrupt.error());
  return "";
}

Error refused(std::string_view what) {
  return {.code = Errc::not_confirmed,
          .message = fmt::format("{}: not confirmed, nothing was done", what)};
}

}  // namespace

Result<void> ask_consent(std::string_view what, const Context& context) {
  const auto answer = ask(what, "Go on? [y/N]", context);
  if (!answer) return tl::unexpected(answer.error());
  if (!*answer || **answer == "y" || **answer == "Y" || **answer == "yes") return {};
  return tl::unexpected(refused(what));
}

Result<void> ask_typed_consent(std::string_view what, std::string_view word,
                               const Context& context) {
  const auto answer = ask(what, fmt::format("Type '{}' to go on:", word), context);
  if (!answer) return tl::unexpected(answer.error());
  if (!*answer || **answer == word) return {};
  return tl::unexpected(refused(what));
}

}  // namespace spindle::commands
