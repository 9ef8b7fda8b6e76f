#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <utility>

#include "change_history.hpp"
#include "spindle/commands/commands.hpp"

namespace spindle::commands {
namespace {

/// What the changes of one command with an id that is meant by this text have in common: the part
/// in front of the last '-'.
std::string run_of(const std::string& id) { return id.substr(0, id.rfind('-')); }

bool is_meant(const PastChange& change, const std::string& text) {
  return change.id == text || run_of(change.id) == text;
}

/// Whether it left a value that is no longer the one before.
bool has_changed(const PastChange& change) {
  constexpr std::array<std::string_view, 3> results = {"written", "coerced", "changed-along"};
  return std::find(results.begin(), results.end(), change.result) != results.end();
}

Error nothing_to_undo(const std::string& id) {
  return {.code = Errc::unknown_name,
          .message = id.empty() ? "the record of changes has nothing that can be taken back"
                                : fmt::format("the record of changes has no change '{}'", id),
          .hint = "'spindle log' shows what was changed",
          .remedy = {.right = "spindle log"}};
}

/// The changes that are meant, in the order in which they were made.
Result<std::vector<const PastChange*>> choose(const std::string& id, const ChangeHistory& history) {
  std::string wanted = id;
  if (wanted.empty()) {
    const auto last = std::find_if(history.changes.rbegin(), history.changes.rend(), has_changed);
    if (last == history.changes.rend()) return tl::unexpected(nothing_to_undo(id));
    wanted = run_of(last->id);
  }
  std::vector<const PastChange*> chosen;
  for (const PastChange& change : history.changes) {
    if (is_meant(change, wanted)) chosen.push_back(&change);
  }
  if (chosen.empty()) return tl::unexpected(nothing_to_undo(id));
  return chosen;
}

Error not_recorded(const PastChange& change) {
  return {.code = Errc::usage,
          .message = change.register_address == report::Cell()
                         ? "an action cannot be taken back"
                         : "what it was before is not recorded",
          .target = change.target,
          .name = change.name};
}

}  // namespace

Result<Outcome> undo(const UndoOptions& options, Context& context) {
  TRY_LET(const auto history, read_changes(context));
  TRY_LET(const auto chosen, choose(options.id, history));
  const std::string& target = chosen.front()->target;
  SetOptions wanted{.targets = {target},
                    .assignments = {},
                    .execution = options.execution,
                    .undoing = Undoing{.serial = chosen.front()->serial}};
  std::map<std::string, std::string> before;
  for (const PastChange* change : chosen) {
    if (change->target != target || change->serial != wanted.undoing->serial) {
      return tl::unexpected(Error{.code = Errc::usage,
                                  .message = "changes of several tools have this id",
                                  .hint = fmt::format("name one, such as {}", change->id)});
    }
    if (!has_changed(*change)) continue;
    if (change->before == report::Cell()) return tl::unexpected(not_recorded(*change));
    const bool is_first = before.emplace(change->name, report::to_text(change->before)).second;
    wanted.undoing->left.insert_or_assign(change->name, report::to_text(change->after));
    if (is_first) wanted.assignments.push_back(change->name);
    if (change->name.starts_with('@')) wanted.raw = RawWrites::ask;
  }
  if (wanted.assignments.empty()) return tl::unexpected(nothing_to_undo(options.id));
  std::reverse(wanted.assignments.begin(), wanted.assignments.end());
  for (std::string& assignment : wanted.assignments) {
    assignment = fmt::format("{}={}", assignment, before.at(assignment));
  }
  return set(wanted, context);
}

}  // namespace spindle::commands
