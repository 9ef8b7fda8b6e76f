#include "group.hpp"

#include <fmt/ranges.h>

#include "shared_lines.hpp"
#include "spindle/base/text.hpp"

namespace spindle::commands {

Result<std::vector<Target>> resolve_one_or_group(const std::string& text, Reach reach,
                                                 const Context& context) {
  auto targets = resolve_compatible_targets({text}, context);
  if (!targets) return targets;
  if (reach == Reach::everybody && targets->size() > 1) {
    return tl::unexpected(
        Error{.code = Errc::usage,
              .message = fmt::format("--broadcast is for everybody on one serial line, and '{}' is "
                                     "{} tools",
                                     text, targets->size()),
              .hint = "name the line, as in rtu:///dev/ttyUSB0?unit=0, or leave out --broadcast"});
  }
  for (Target& target : *targets) target.reach = reach;
  return targets;
}

bool is_group(const std::string& text, Reach reach) {
  return names_group(text) && reach == Reach::one;
}

std::string tools_in_words(const std::vector<std::string>& names, std::size_t of) {
  const std::string some = names.size() == of ? "" : fmt::format("{} of ", names.size());
  return fmt::format("{}{} ({})", some, counted(of, "tool"), fmt::join(names, ", "));
}

std::string failed_in_words(std::size_t failed, std::size_t of) {
  return failed == 0 ? "" : fmt::format("; {} of {} failed", failed, counted(of, "tool"));
}

Error of_tool(const Target& target, Error error) {
  return error.target.empty() ? target.blamed(std::move(error)) : error;
}

Error not_begun(const Target& target, const Context& context) {
  Error error = context.interrupt.error();
  error.message = "interrupted before its turn came, nothing was sent";
  return target.blamed(std::move(error));
}

bool refuses_all(const Error& error) {
  switch (error.status()) {
    case ExitStatus::unreachable:
    case ExitStatus::no_answer:
    case ExitStatus::refused:
    case ExitStatus::malformed:
      return false;
    default:
      return true;
  }
}

Result<Outcome> refuse_all(const Outcome& refused, Summary summary, std::size_t of,
                           Context& context) {
  summary.sentence = fmt::format("nothing was done: this does not fit {} of {}", refused.failed(),
                                 counted(of, "tool"));
  return tell(std::move(summary), refused, context).map([&] { return refused; });
}

bool is_interruption(const Error& error) {
  return error.code == Errc::interrupted || error.code == Errc::terminated;
}

Error of_write(const std::string& parameter, Error error) {
  if (!is_interruption(error)) return error;
  error.name = parameter;
  error.hint = "whether it was written is not known: read it again";
  return error;
}

}  // namespace spindle::commands
