#include <fmt/format.h>
#include <fmt/ranges.h>

#include <utility>

#include "consent.hpp"
#include "group.hpp"
#include "set_group.hpp"
#include "set_plan.hpp"
#include "set_records.hpp"
#include "set_writer.hpp"
#include "spindle/commands/commands.hpp"
#include "spindle/commands/target.hpp"
#include "storing.hpp"

namespace spindle::commands {
namespace {

using catalogue::Profile;

/// What has to be asked before anything is written.
Result<void> ask_first(const SetOptions& options, const Profile& profile, const Target& target,
                       const Context& context) {
  std::vector<std::string> what;
  if (options.reach == Reach::everybody) what.emplace_back("set");
  if (auto storing = check_storing(options.storing, profile); !storing) return storing;
  if (options.storing == Storing::yes) what.emplace_back(store_action);
  if (what.empty() || options.execution == Execution::dry_run) return {};
  return ask_consent(fmt::format("{} on {}", fmt::join(what, ", "), target.shown), context);
}

Result<Outcome> end_dry_run(const std::vector<SetStep>& steps, const Target& target,
                            Context& context) {
  Outcome outcome;
  Listing listing(context, set_plan_columns());
  for (const SetStep& step : steps) {
    listing.add(step_record(step, Ending::planned, step.assignment.value, target, context.clock));
    outcome.succeed();
  }
  Summary summary = plan_summary(counts_of(steps), target.shown);
  summary.sentence += "; nothing was written (dry run)";
  return finish(listing, outcome, std::move(summary), context);
}

Result<Outcome> set_one(const Target& target, const SetOptions& options, Context& context) {
  const auto prepare = [&](const Profile& profile) {
    return parse_assignments(options.assignments, profile)
        .and_then([&](std::vector<Assignment> assignments) {
          return ask_first(options, profile, target, context).map([&] {
            return std::move(assignments);
          });
        });
  };
  auto opened = open_prepared(reopening(target), Need::named_registers, context, prepare);
  if (!opened) return tl::unexpected(std::move(opened.error()));
  OpenTool& tool = opened->tool;
  const bool everybody = options.reach == Reach::everybody;
  const auto steps = everybody ? steps_for_everybody(std::move(opened->prepared))
                               : check_against_tool(std::move(opened->prepared), tool.device);
  if (!steps) return tl::unexpected(steps.error());
  if (options.execution == Execution::dry_run) return end_dry_run(*steps, tool.target, context);
  SetWriter writer(tool, options.storing, context);
  tell_risks(*steps, tool.target, context);
  return (everybody ? writer.send(*steps) : writer.write(*steps)).map([](const SetResult& result) {
    return result.outcome;
  });
}

}  // namespace

Result<Outcome> set(const SetOptions& options, Context& context) {
  const auto targets = resolve_one_or_group(options.target, options.reach, context);
  if (!targets) return tl::unexpected(targets.error());
  return is_group(options.target, options.reach) ? set_group(*targets, options, context)
                                                 : set_one(targets->front(), options, context);
}

}  // namespace spindle::commands
