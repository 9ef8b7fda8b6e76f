#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "change_history.hpp"
#include "listing.hpp"
#include "records.hpp"
#include "spindle/base/local_time.hpp"
#include "spindle/base/text.hpp"
#include "spindle/commands/commands.hpp"
#include "spindle/files/change_log.hpp"
#include "time_field.hpp"

namespace spindle::commands {
namespace {

using report::Align;

const std::array<report::Column, 10> columns = {
    {{"ID", "id"},
     {"TIME", "changed", Align::left, 0, report::wrapped(10)},
     {"TARGET", "target", Align::left, 0, report::wrapped(12)},
     {"NAME", "name", Align::left, 0, report::wrapped(14)},
     {"OLD", "old", Align::right},
     {"NEW", "new", Align::right},
     {"UNIT", "unit"},
     {"RESULT", "result"},
     {"COMMAND", "command", Align::left, 0, report::left_out(2)},
     {"USER", "user", Align::left, 0, report::left_out(1)}}};

/// Which changes are meant; what is empty means all.
struct Wanted {
  std::vector<std::string> tools;
  std::vector<std::string> names;
  std::string since;  ///< as it stands in the record

  [[nodiscard]] bool takes(const PastChange& change) const {
    const auto is_tool = [&](const std::string& text) {
      return text == change.target || text == change.serial;
    };
    const auto is_name = [&](const std::string& text) {
      return glob_match(text, change.name) || change.name.ends_with("." + text) ||
             change.name.starts_with(text + ".");
    };
    return change.time >= since &&
           (tools.empty() || std::any_of(tools.begin(), tools.end(), is_tool)) &&
           (names.empty() || std::any_of(names.begin(), names.end(), is_name));
  }
};

/// A word is a tool where one has this name, or a change was made to one; a group is its tools.
Result<Wanted> wanted_by(const LogOptions& options, const ChangeHistory& history,
                         const Context& context) {
  Wanted wanted;
  for (const std::string& word : options.arguments) {
    const bool was_changed = std::any_of(
        history.changes.begin(), history.changes.end(),
        [&](const PastChange& change) { return change.target == word || change.serial == word; });
    if (!is_target(word, context)) {
      (was_changed ? wanted.tools : wanted.names).push_back(word);
      continue;
    }
    TRY_LET(const auto targets, resolve_targets({word}, context));
    for (const Target& target : targets) wanted.tools.push_back(target.shown);
  }
  if (options.since.empty()) return wanted;
  TRY_LET(const auto since, parse_time(options.since, context.clock));
  wanted.since = report::to_text(since);
  return wanted;
}

report::Record change_record(const PastChange& change, const Context& context) {
  const auto time = parse_time(change.time, context.clock);
  const bool is_open = change.result == files::begun;
  return {.type = "changed",
          .target = change.target,
          .time = context.clock.wall(),
          .fields = {
              {"id", text_or_null(change.id)},
              time ? time_field("changed", *time, context) : report::Field{"changed", change.time},
              {"user", change.user},
              {"command", change.command},
              {"serial", text_or_null(change.serial)},
              {"name", change.name},
              {"register", change.register_address},
              {"old", change.before, change.label_before},
              {"new", change.after, change.label_after},
              {"unit", text_or_null(change.unit)},
              {"result", change.result, is_open ? "unknown: spindle was ended" : ""},
              {"old_label", text_or_null(change.label_before)},
              {"new_label", text_or_null(change.label_after)},
              {"undoes", text_or_null(change.undoes)}}};
}

}  // namespace

Result<Outcome> log(const LogOptions& options, Context& context) {
  TRY_LET(const auto history, read_changes(context));
  TRY_LET(const auto wanted, wanted_by(options, history, context));
  std::vector<const PastChange*> chosen;
  for (const PastChange& change : history.changes) {
    if (wanted.takes(change)) chosen.push_back(&change);
  }
  const std::size_t shown = std::min(options.count.value_or(chosen.size()), chosen.size());
  Listing listing(context, columns);
  for (std::size_t at = chosen.size() - shown; at < chosen.size(); ++at) {
    listing.add(change_record(*chosen[at], context));
  }
  if (history.unreadable > 0) {
    context.renderer.note(fmt::format("{} of the record of changes cannot be read",
                                      counted(history.unreadable, "line")));
  }
  Outcome outcome;
  outcome.succeed();
  return finish(
      listing, outcome,
      {.counts = {{"changes", count(shown)}, {"unreadable", count(history.unreadable)}},
       .sentence = shown == chosen.size() ? counted(shown, "change")
                                          : fmt::format("the newest {} of {}", shown,
                                                        counted(chosen.size(), "change"))},
      context);
}

}  // namespace spindle::commands
