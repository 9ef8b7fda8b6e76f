#include "consent.hpp"

#include <fmt/format.h>

#include <utility>

namespace spindle::commands {

bool can_ask(const Context& context) {
  return context.user.consent == Consent::ask && context.io.in_is_terminal &&
         context.io.err_is_terminal;
}

namespace {

Error unanswerable(std::string_view what) {
  return {.code = Errc::not_confirmed,
          .message = fmt::format("{}: this has to be confirmed", what),
          .hint = "add --yes when you are sure"};
}

/// The question behind what it is about, in one piece.
std::string on_one_line(std::string_view what, std::string_view question, std::size_t columns) {
  std::string text = report::wrapped(fmt::format("{}.", what), columns);
  const std::size_t begin = text.rfind('\n');
  const std::size_t width = text.size() - (begin == std::string::npos ? 0 : begin + 1);
  constexpr std::size_t answer = 16;  // stands behind it
  const bool fits = width + 1 + question.size() + answer <= columns;
  return text + (fits ? " " : "\n  ") + std::string(question);
}

/// What the user typed; empty: --yes answers.
Result<std::optional<std::string>> ask(std::string_view what, std::string_view question,
                                       const Context& context) {
  if (context.user.consent == Consent::given) return std::nullopt;
  if (!can_ask(context)) return tl::unexpected(unanswerable(what));
  context.io.err(on_one_line(what, question, report::columns_of(context.io)) + " ");
  const auto answer = context.io.read_line();
  if (answer) return *answer;
  context.io.err("\n");  // behind a question without an answer, the terminal's line goes on
  if (context.interrupt.signalled()) return tl::unexpected(context.interrupt.error());
  return "";
}

/// Without a hint the usual one names the answer to a question.
Error refused(std::string_view what, std::string hint = {}) {
  return {.code = Errc::not_confirmed,
          .message = fmt::format("{}: not confirmed, nothing was done", what),
          .hint = std::move(hint)};
}

}  // namespace

Result<void> ask_consent(std::string_view what, const Context& context) {
  TRY_LET(const auto answer, ask(what, "Go on? [y/N]", context));
  if (!answer || *answer == "y" || *answer == "Y" || *answer == "yes") return {};
  return tl::unexpected(refused(what));
}

Result<void> ask_typed_consent(std::string_view what, std::string_view word,
                               const Context& context) {
  TRY_LET(const auto answer, ask(what, fmt::format("Type '{}' to go on:", word), context));
  if (!answer || *answer == word) return {};
  return tl::unexpected(
      refused(what, fmt::format("type '{}', or add --yes, when you are sure", word)));
}

Result<void> require_answer(std::string_view what, const Context& context) {
  if (context.user.consent == Consent::given || can_ask(context)) return {};
  return tl::unexpected(unanswerable(what));
}

Result<void> ask_away_from(OpenTool& tool, std::string_view what, const Context& context) {
  const auto identity = tool.device.identity();
  tool.device.disconnect();
  TRY(ask_consent(what, context));
  const Target known = known_target(tool);
  TRY_LET(auto profile, load_profile(known, context));
  TRY_LET(auto again,
          open_tool(known, std::move(profile), Need::named_registers, Purpose::change, context));
  const auto now = again.device.identity();
  if (identity && now && identity->serial != now->serial) {
    return tl::unexpected(with_target(
        Error{
            .code = Errc::mismatch,
            .message = fmt::format("another tool answers now: serial {}, and it was {} before the "
                                   "question",
                                   now->serial, identity->serial),
            .hint = "nothing was done"},
        tool.target));
  }
  again.target = tool.target;
  tool = std::move(again);
  return {};
}

}  // namespace spindle::commands
