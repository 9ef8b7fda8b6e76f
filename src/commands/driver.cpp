#include "driver.hpp"

#include <fmt/ranges.h>

#include <utility>

#include "spindle/base/text.hpp"
#include "spindle/work/shared_lines.hpp"

namespace spindle::commands {

Result<Targets> resolve_one_or_group(const std::vector<std::string>& texts, Addressing addressing,
                                     const Context& context) {
  auto tools = resolve_compatible_targets(texts, context);
  if (!tools) return tl::unexpected(std::move(tools.error()));
  if (addressing == Addressing::broadcast && tools->size() > 1) {
    return tl::unexpected(
        Error{.code = Errc::usage,
              .message = fmt::format("--broadcast is for everybody on one serial line, and '{}' is "
                                     "{} tools",
                                     fmt::join(texts, " "), tools->size()),
              .hint = "name the line, as in rtu:///dev/ttyUSB0?unit=0, or leave out --broadcast"});
  }
  for (Target& target : *tools) target.addressing = addressing;
  const bool are_several = texts.size() > 1 || names_group(texts.front()) ||
                           context.user.choice == TargetChoice::by_default;
  return Targets{.tools = std::move(*tools),
                 .is_group = are_several && addressing == Addressing::unicast};
}

namespace {

Error doubtful(const DoubtfulWord& doubt, std::string_view what, const Context& context) {
  const std::string& word = doubt.word;
  Error error{.code = Errc::usage,
              .message = fmt::format("'{}' is the name of a tool, and of {}", word, what),
              .hint = "behind -- no word is a tool"};
  if (!doubt.profile.empty()) {
    error.hint += "; without a default target, as after 'spindle use -', it is the tool";
  }
  error.remedy.right = "spindle";
  bool is_marked = false;
  for (const std::string& typed : context.io.typed) {
    if (typed == word && !std::exchange(is_marked, true)) error.remedy.right += " --";
    error.remedy.right += " " + shell_word(typed);
  }
  return error;
}

}  // namespace

Result<void> check_doubtful(const Otherwise& otherwise, const catalogue::Profile& profile,
                            const Context& context) {
  for (const DoubtfulWord& doubt : context.user.doubtful) {
    std::string_view meaning;
    if (doubt.profile.empty()) {
      meaning = otherwise(doubt.word, profile);
    } else if (const auto usual = context.profiles.load(doubt.profile)) {
      meaning = otherwise(doubt.word, *usual);
    }
    if (!meaning.empty()) return tl::unexpected(doubtful(doubt, meaning, context));
  }
  return {};
}

Targets reopening(Targets targets) {
  for (Target& target : targets.tools) target = reopening(std::move(target));
  return targets;
}

void tell_caution(const OpenTool& tool, const Context& context) {
  const auto& identity = tool.device.identity();
  if (!identity || !tool.profile->identity) return;
  const std::string caution = catalogue::caution_of(*tool.profile->identity, *identity);
  if (caution.empty()) return;
  context.renderer.note(fmt::format("warning: {}: firmware {}: {}", tool.target.shown,
                                    identity->firmware.value_or(0), caution));
}

void tell_remarks(const OpenTool& tool, const Context& context) {
  for (const std::string& remark : tool.remarks) {
    context.renderer.note(fmt::format("{}: {}", tool.target.shown, remark));
  }
}

Result<OpenTool> open_to_read(const Target& target, catalogue::Profile profile,
                              const Context& context) {
  auto tool = open_tool(target, std::move(profile), Need::named_registers, Purpose::read, context);
  if (tool) tell_remarks(*tool, context);
  return tool;
}

Result<void> begin_turn(const Target& target, const Context& context) {
  if (!context.interrupt.signalled()) return {};
  Error error = context.interrupt.error();
  error.message = "interrupted before its turn came, nothing was sent";
  return tl::unexpected(with_target(std::move(error), target));
}

std::string tools_in_words(const std::vector<std::string>& names, std::size_t of) {
  const std::string some = names.size() == of ? "" : fmt::format("{} of ", names.size());
  return fmt::format("{}{} ({})", some, counted(of, "tool"), fmt::join(names, ", "));
}

std::string failed_in_words(std::size_t failed, std::size_t of) {
  return failed == 0 ? "" : fmt::format("; {} of {} failed", failed, counted(of, "tool"));
}

bool rejects_all(const Error& error) {
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

bool is_of_stream(const Error& error) {
  return error.code == Errc::closed_pipe || error.code == Errc::storage;
}

OnFinished show_finished(ProgressLine& progress) {
  return [&progress](const Finished& finished) {
    progress.advance({.what = "tools done:",
                      .done = finished.done,
                      .total = finished.total,
                      .at_once = finished.at_once});
  };
}

std::unique_ptr<GroupOutput> make_output(std::size_t tools,
                                         const std::vector<report::Column>& live_columns,
                                         report::Renderer& renderer) {
  if (live_columns.empty()) return std::make_unique<RecordedOutput>(tools, renderer);
  return std::make_unique<SharedOutput>(tools, live_columns, renderer);
}

Result<Outcome> end_group(GroupOutput& output, std::optional<Summary> summary,
                          const Outcome& outcome, Context& context) {
  auto shown = output.end();
  if (shown && summary) shown = tell(std::move(*summary), outcome, context);
  return shown.map([&] { return outcome; });
}

}  // namespace spindle::commands
