#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "change_history.hpp"
#include "spindle/commands/commands.hpp"

namespace spindle::commands {
namespace {

using Changes = std::vector<const PastChange*>;

bool is_meant(const PastChange& change, const std::string& text) {
  return change.id == text || change.id.starts_with(text + "-");
}

Error nothing_to_undo(const std::string& id) {
  return {.code = Errc::unknown_name,
          .message = id.empty() ? "the record of changes has nothing that can be taken back"
                                : fmt::format("the record of changes has no change '{}'", id),
          .hint = "'spindle log' shows what was changed",
          .remedy = {.right = "spindle log"}};
}

Error nothing_left(const std::string& id, const Changes& changes) {
  std::set<std::string> results;
  for (const PastChange* change : changes) results.insert(change->result);
  return {.code = Errc::usage,
          .message = fmt::format("change '{}' has nothing that can be taken back: {}", id,
                                 fmt::join(results, ", ")),
          .hint = "only values that were written can"};
}

/// The part of the changes that still counts: what was put back at once is none.
Undoing effects_of(const Changes& changes) {
  Undoing undoing;
  for (const PastChange* change : changes) {
    UndoneTool& tool = undoing[change->target];
    tool.serial = change->serial;
    const auto known =
        std::find_if(tool.values.begin(), tool.values.end(),
                     [&](const UndoneValue& value) { return value.name == change->name; });
    if (change->result == "rolled-back" && known != tool.values.end()) tool.values.erase(known);
    if (!may_have_changed(*change)) continue;
    const std::string before = report::to_text(change->before);
    UndoneValue value{.name = change->name, .before = before};
    if (known != tool.values.end()) {
      value = *known;
      tool.values.erase(known);
    }
    value.id = change->id;
    value.unit = change->unit;
    if (has_changed(*change)) value.left.clear();
    value.doubt = has_changed(*change) ? std::string() : change->result;
    value.left.push_back(report::to_text(change->after));
    if (!value.doubt.empty()) value.left.push_back(before);
    tool.values.push_back(std::move(value));
  }
  std::erase_if(undoing, [](const auto& one) { return one.second.values.empty(); });
  for (auto& [target, tool] : undoing) std::reverse(tool.values.begin(), tool.values.end());
  return undoing;
}

/// Of the last command that left something, other than undo: what was not taken back yet. A
/// simulated tool is gone with the command that changed it.
Changes last_changes(const ChangeHistory& history) {
  const std::set<std::string> taken = taken_back(history);
  const auto counts = [&](const PastChange& change) {
    return !change.id.empty() && change.command != "undo" && !change.target.starts_with("sim:") &&
           !taken.contains(value_of(change));
  };
  std::set<std::string> seen;
  for (auto last = history.changes.rbegin(); last != history.changes.rend(); ++last) {
    if (!counts(*last) || !may_have_changed(*last)) continue;
    const std::string run = run_of(last->id);
    if (!seen.insert(run).second) continue;
    Changes changes;
    for (const PastChange& change : history.changes) {
      if (counts(change) && run_of(change.id) == run) changes.push_back(&change);
    }
    if (!effects_of(changes).empty()) return changes;
  }
  return {};
}

Changes meant_by(const std::string& id, const ChangeHistory& history) {
  Changes changes;
  for (const PastChange& change : history.changes) {
    if (is_meant(change, id)) changes.push_back(&change);
  }
  return changes;
}

/// Two commands may have the same id, by chance.
Result<void> check_one_command(const Changes& changes) {
  std::map<std::string, const PastChange*> known;
  const auto in_words = [](const PastChange& change) {
    return fmt::format("{} of {} on {} at {}", change.command, change.name, change.target,
                       change.time);
  };
  for (const PastChange* change : changes) {
    const auto [other, is_new] = known.emplace(change->id, change);
    const PastChange& first = *changes.front();
    const bool is_same = is_new && change->command == first.command &&
                         (change->target != first.target || change->serial == first.serial);
    if (is_same) continue;
    const PastChange& one = is_new ? first : *other->second;
    return tl::unexpected(Error{
        .code = Errc::usage,
        .message =
            fmt::format("two commands have the id '{}': {}, and {}",
                        is_new ? run_of(change->id) : change->id, in_words(one), in_words(*change)),
        .hint = "set the values by hand; 'spindle log' shows what they were",
        .remedy = {.right = "spindle log"}});
  }
  return {};
}

/// A secret is not recorded.
Result<void> check_recorded(const Changes& changes) {
  for (const PastChange* change : changes) {
    if (!has_changed(*change) || change->before != report::Cell()) continue;
    return tl::unexpected(Error{.code = Errc::usage,
                                .message = "what it was before is not recorded",
                                .target = change->target,
                                .name = change->name});
  }
  return {};
}

}  // namespace

Result<Outcome> undo(const UndoOptions& options, Context& context) {
  TRY_LET(const auto history, read_changes(context));
  const Changes chosen = options.id.empty() ? last_changes(history) : meant_by(options.id, history);
  if (chosen.empty()) return tl::unexpected(nothing_to_undo(options.id));
  TRY(check_one_command(chosen));
  TRY(check_recorded(chosen));
  Undoing undoing = effects_of(chosen);
  if (undoing.empty()) return tl::unexpected(nothing_left(options.id, chosen));
  SetOptions wanted{.targets = {}, .assignments = {}, .execution = options.execution};
  for (const auto& [target, tool] : undoing) {
    wanted.targets.push_back(target);
    for (const UndoneValue& value : tool.values) {
      wanted.assignments.push_back(fmt::format("{}={}", value.name, value.before));
      if (value.name.starts_with('@')) wanted.raw = RawWrites::ask;
    }
  }
  wanted.undoing = std::move(undoing);
  return set(wanted, context);
}

}  // namespace spindle::commands
