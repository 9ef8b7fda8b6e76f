#include "spindle/commands/naming.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "spindle/base/text.hpp"
#include "spindle/work/default_target.hpp"

namespace spindle::commands {
namespace {

bool assigns(const std::string& word) { return word.find('=') != std::string::npos; }

/// A group that is not there is one all the same; a raw register has a ':'.
bool looks_like_target(const std::string& word, const Context& context) {
  const bool is_group = names_group(word) && word.find(':') == std::string::npos;
  return is_group || is_target(word, context);
}

Error no_target(std::string_view command) {
  Error error{.code = Errc::usage, .message = fmt::format("{}: TARGET is missing", command)};
  error.remedy.right = fmt::format("spindle {} --help", command);
  error.hint = fmt::format("'{}' shows examples", error.remedy.right);
  return error;
}

/// Of a tools file with faults nothing is taken for certain.
Result<void> check_file(const SortedWords& sorted, const Context& context) {
  if (!context.tools.left_out) return {};
  const bool by_url =
      std::all_of(sorted.targets.begin(), sorted.targets.end(),
                  [](const std::string& word) { return link::looks_like_url(word); });
  return by_url ? Result<void>() : tl::unexpected(*context.tools.left_out);
}

/// The default target of a user who names tools, if there is one that can be used.
std::optional<Target> unnamed_default(const Context& context) {
  const auto usual = work::default_target(context);
  if (!usual || !*usual) return std::nullopt;
  auto targets = resolve_targets({(*usual)->text}, context);
  if (!targets || targets->empty()) return std::nullopt;
  return std::move(targets->front());
}

/// Names of tools that may be those of something else, too: behind a first tool, whose they would
/// be, or where a default one could be meant.
std::vector<DoubtfulWord> doubtful_of(const std::vector<std::string>& targets,
                                      const Context& context) {
  std::vector<DoubtfulWord> doubtful;
  for (std::size_t index = 0; index < targets.size(); ++index) {
    const std::string& word = targets[index];
    if (names_group(word) || link::looks_like_url(word)) continue;
    if (index > 0) {
      doubtful.push_back({word});
    } else if (const auto usual = unnamed_default(context)) {
      doubtful.push_back({word, usual->profile});
    }
  }
  return doubtful;
}

Result<void> take_default(SortedWords& sorted, OtherWords kind, std::string_view command,
                          Context& context) {
  TRY_LET(const auto usual, work::default_target(context));
  if (usual) {
    sorted.targets = {usual->text};
    context.user.choice = TargetChoice::by_default;
    if (context.io.err_is_terminal) {
      context.renderer.note(fmt::format("the target is {}, by {}", usual->text, usual->origin));
    }
    return {};
  }
  const auto first = std::find_if(sorted.others.begin(), sorted.others.end(), [&](auto& word) {
    return kind != OtherWords::assignments || !assigns(word);
  });
  if (first == sorted.others.end()) return tl::unexpected(no_target(command));
  sorted.targets = {std::exchange(*first, {})};
  sorted.others.erase(first);
  return {};
}

/// A word that assigns nothing is a misspelt tool where it is near one.
Result<void> check_assignments(const SortedWords& sorted, const Context& context) {
  for (const std::string& word : sorted.others) {
    if (assigns(word)) continue;
    const auto known = resolve_targets({word}, context);
    if (!known && !known.error().remedy.wrong.empty()) return tl::unexpected(known.error());
  }
  return {};
}

}  // namespace

Result<SortedWords> sort_words(const TypedWords& typed, OtherWords kind, std::string_view command,
                               Context& context) {
  SortedWords sorted;
  const auto& words = typed.words;
  // As behind a variable of a script that is not set: no tool is named, and the default is not
  // meant.
  const bool is_unset =
      std::any_of(words.begin(), words.end(), [](const std::string& word) { return word.empty(); });
  if (is_unset) return tl::unexpected(no_target(command));
  for (std::size_t index = 0; index < words.size(); ++index) {
    const bool may_be_target = index + typed.behind_dashes < words.size();
    const bool is_tool =
        kind == OtherWords::none || (may_be_target && looks_like_target(words[index], context));
    (is_tool ? sorted.targets : sorted.others).push_back(words[index]);
  }
  const bool is_named = !sorted.targets.empty();
  if (!is_named) {
    TRY(take_default(sorted, kind, command, context));
  }
  if (kind != OtherWords::none) {
    TRY(check_file(sorted, context));
  }
  if (kind == OtherWords::names && is_named) {
    context.user.doubtful = doubtful_of(sorted.targets, context);
  }
  if (kind == OtherWords::assignments) {
    TRY(check_assignments(sorted, context));
  }
  return sorted;
}

Error or_misspelt_tool(Error error, const Context& context) {
  const bool may_be =
      context.user.choice == TargetChoice::by_default && error.code == Errc::unknown_name;
  if (!may_be || !error.remedy.wrong.empty() || error.name.empty()) return error;
  const auto tool = resolve_targets({error.name}, context);
  if (tool || tool.error().remedy.wrong.empty()) return error;
  error.hint = tool.error().hint;
  error.remedy = tool.error().remedy;
  return error;
}

}  // namespace spindle::commands
