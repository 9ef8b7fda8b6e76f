#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "group_output.hpp"
#include "progress.hpp"
#include "spindle/commands/context.hpp"
#include "spindle/work/side_by_side.hpp"
#include "verb.hpp"

/// The one way to run a verb on one tool or on several. Whose turn it is, is known here alone:
/// so errors become errors of a tool here, and an interrupt is told of each tool that it kept
/// waiting.
namespace spindle::commands {

/// What names, @groups and URLs mean; a broadcast has one target, which is everybody. The default
/// target counts as a group of one: its name is told, and what changes it is asked about.
Result<Targets> resolve_one_or_group(const std::vector<std::string>& texts, Addressing addressing,
                                     const Context& context);

/// What a word means otherwise than as a tool, by a profile, such as "a parameter"; empty: nothing.
using Otherwise =
    std::function<std::string_view(const std::string& word, const catalogue::Profile& profile)>;

/// Error `usage` where a word that was taken for a tool may also mean something else. `profile` is
/// that of a tool that is meant.
Result<void> check_doubtful(const Otherwise& otherwise, const catalogue::Profile& profile,
                            const Context& context);

/// The same targets, whose connections are opened once more where the tools close them.
Targets reopening(Targets targets);

/// Refuses a tool whose turn comes after the request to end.
Result<void> begin_turn(const Target& target, const Context& context);

/// "2 of 3 tools (station3, station4)"; without "of 3" where these are all.
std::string tools_in_words(const std::vector<std::string>& names, std::size_t of);

/// "; 1 of 3 tools failed"; empty where none did.
std::string failed_in_words(std::size_t failed, std::size_t of);

/// Before something is written: what the profile says of a tool with this firmware.
void tell_caution(const OpenTool& tool, const Context& context);

/// What people should know of how this tool was opened.
void tell_remarks(const OpenTool& tool, const Context& context);

/// Opens a tool on which nothing is changed, and tells them.
Result<OpenTool> open_to_read(const Target& target, catalogue::Profile profile,
                              const Context& context);

/// Whether such a failure says that the request is wrong rather than that the tool is not there.
bool rejects_all(const Error& error);

inline const Outcome& outcome_of(const Outcome& outcome) { return outcome; }
template <typename Done>
const Outcome& outcome_of(const Done& done) {
  return done.outcome;
}

/// Whether what was told could not be written, which is about no tool.
bool is_of_stream(const Error& error);

/// Shows how many tools are done. `progress` must outlive it.
OnFinished show_finished(ProgressLine& progress);

/// One of several tools, or what is planned for it, with its place to say something.
template <typename Item>
struct Turn {
  const Item* item;
  report::Renderer* renderer;
};
template <typename Item>
const Target& target_of(const Turn<Item>& turn) {
  return target_of(*turn.item);
}

/// Calls `handle(item, context)` side by side with a context whose renderer is the tool's own of
/// `output`. An error that it returns is told there as one of this tool.
template <typename Item, typename Handle>
auto for_each_told(const std::vector<Item>& items, std::size_t jobs, GroupOutput& output,
                   Context& context, Handle handle) {
  using Attempt = std::invoke_result_t<Handle, const Item&, Context&>;
  std::vector<Turn<Item>> turns;
  for (const Item& item : items) turns.push_back({&item, &output.of_tool(turns.size())});
  const auto handle_one = [&](const Turn<Item>& turn) {
    Context own = with_renderer(context, *turn.renderer);
    if (items.size() > 1) own.user.progress = report::Showing::unwanted;  // there is one for all
    Attempt attempt = handle(*turn.item, own);
    if (!attempt) {
      attempt.error() = with_target(std::move(attempt.error()), target_of(turn));
      static_cast<void>(turn.renderer->error(attempt.error(), context.clock.wall()));
    }
    return attempt;
  };
  std::optional<ProgressLine> progress;
  if (!output.is_live() && items.size() > 1) progress.emplace(context);
  return side_by_side(turns, jobs, handle_one, progress ? show_finished(*progress) : OnFinished());
}

template <typename Done>
Outcome outcome_of_all(const std::vector<Result<Done>>& results) {
  Outcome outcome;
  for (const auto& result : results) {
    result ? outcome.add(outcome_of(*result)) : outcome.fail(result.error());
  }
  return outcome;
}

/// One that shows lists of these columns while they grow, or without columns one that records.
std::unique_ptr<GroupOutput> make_output(std::size_t tools,
                                         const std::vector<report::Column>& live_columns,
                                         report::Renderer& renderer);

/// Shows what was told, then the summary of all.
Result<Outcome> end_group(GroupOutput& output, std::optional<Summary> summary,
                          const Outcome& outcome, Context& context);

}  // namespace spindle::commands
