#include "set_group.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "consent.hpp"
#include "group.hpp"
#include "set_plan.hpp"
#include "set_records.hpp"
#include "set_writer.hpp"
#include "spindle/base/text.hpp"
#include "storing.hpp"

namespace spindle::commands {
namespace {

using catalogue::Profile;

/// What is meant for one tool of the group, and which tool it was.
struct ToolPlan {
  std::vector<SetStep> steps;
  std::string serial;  ///< empty: the product does not say it

  [[nodiscard]] std::vector<Assignment> assignments() const {
    std::vector<Assignment> all;
    for (const SetStep& step : steps) all.push_back(step.assignment);
    return all;
  }
  [[nodiscard]] bool changes() const {
    return std::any_of(steps.begin(), steps.end(),
                       [](const SetStep& step) { return step.changes(); });
  }
};

using Ready = Readiness<ToolPlan>;

std::string serial_of(const OpenTool& tool) {
  const auto& identity = tool.device.identity();
  return identity ? identity->serial : std::string();
}

Result<std::vector<Assignment>> understand(const SetOptions& options, const Profile& profile) {
  return parse_assignments(options.assignments, profile)
      .and_then([&](std::vector<Assignment> assignments) {
        return check_storing(options.storing, profile).map([&] { return std::move(assignments); });
      });
}

Result<Planned<ToolPlan>> plan_tool(const Target& target, const SetOptions& options,
                                    const Context& context) {
  auto opened = open_prepared(reopening(target), Need::named_registers, context,
                              [&](const Profile& profile) { return understand(options, profile); });
  if (!opened) return tl::unexpected(std::move(opened.error()));
  OpenTool& tool = opened->tool;
  return check_against_tool(std::move(opened->prepared), tool.device)
      .map([&](std::vector<SetStep> steps) {
        return Planned<ToolPlan>{known_target(tool), {std::move(steps), serial_of(tool)}};
      });
}

/// Tools of which something is written or stored.
std::vector<Target> touched(const Ready& ready, Storing storing) {
  std::vector<Target> tools;
  for (const Target& target : ready.targets) {
    const bool stores = storing == Storing::yes;
    if (stores || ready.plans.at(target.shown).changes()) tools.push_back(target);
  }
  return tools;
}

SetCounts counts_of(const Ready& ready) {
  SetCounts counts;
  for (const auto& [name, plan] : ready.plans) counts.add(counts_of(plan.steps));
  return counts;
}

Result<void> show_plan(const Ready& ready, Context& context) {
  Listing listing(context, with_target(set_plan_columns()));
  for (const Target& target : ready.targets) {
    for (const SetStep& step : ready.plans.at(target.shown).steps) {
      listing.add(step_record(step, Ending::planned, step.assignment.value, target, context.clock));
    }
  }
  return listing.end();
}

Result<Outcome> end_dry_run(const Ready& ready, std::size_t of, Context& context) {
  Outcome outcome = ready.lost;
  for (const Target& target : ready.targets) {
    for (std::size_t step = 0; step < ready.plans.at(target.shown).steps.size(); ++step)
      outcome.succeed();
  }
  if (auto shown = show_plan(ready, context); !shown) return tl::unexpected(shown.error());
  for (const Target& target : ready.targets) {
    Summary summary = plan_summary(counts_of(ready.plans.at(target.shown).steps), target.shown);
    summary.sentence = fmt::format("{}: {}", target.shown, summary.sentence);
    Outcome planned;
    planned.succeed();
    if (auto told = tell(std::move(summary), planned, context); !told) {
      return tl::unexpected(told.error());
    }
  }
  Summary summary = plan_summary(counts_of(ready), {});
  summary.sentence += fmt::format(" on {}{}; nothing was written (dry run)", counted(of, "tool"),
                                  failed_in_words(ready.lost.failed(), of));
  return tell(std::move(summary), outcome, context).map([&] { return outcome; });
}

/// Whoever is asked sees first what it is about.
Result<void> ask(const Ready& ready, const SetOptions& options, std::size_t of, Context& context) {
  for (const Target& target : ready.targets) {
    tell_risks(ready.plans.at(target.shown).steps, target, context);
  }
  const bool stores = options.storing == Storing::yes;
  std::vector<std::string> names;
  for (const Target& target : touched(ready, options.storing)) names.push_back(target.shown);
  if (names.empty()) return {};
  if (can_ask(context)) {
    if (auto shown = show_plan(ready, context); !shown) return shown;
  }
  return ask_consent(fmt::format("write {} to {}{}", counted(counts_of(ready).changed, "value"),
                                 tools_in_words(names, of), stores ? ", and save" : ""),
                     context);
}

/// Whether a tool is still the one that was shown, and holds what was shown.
Result<void> check_unchanged(const ToolPlan& plan, const std::vector<SetStep>& now,
                             const OpenTool& tool) {
  const auto moved = [&](std::string message) {
    return tl::unexpected(
        tool.target.blamed({.code = Errc::mismatch,
                            .message = std::move(message) + ", so nothing was written to this tool",
                            .hint = "look why, then give the command again"}));
  };
  if (const std::string serial = serial_of(tool); serial != plan.serial) {
    return moved(fmt::format("serial {} answers now, and it was {} that was planned for", serial,
                             plan.serial));
  }
  for (std::size_t index = 0; index < now.size(); ++index) {
    const SetStep& step = now[index];
    const SetStep& planned = plan.steps[index];
    const bool same =
        step.before == planned.before && step.assignment.value == planned.assignment.value;
    if (same) continue;
    return moved(fmt::format("{} changed meanwhile from {} to {}", step.assignment.parameter.name,
                             planned.before->to_string(), step.before->to_string()));
  }
  return {};
}

/// A tool that nothing has to be written to is not asked again.
Result<SetResult> keep(const ToolPlan& plan, const Target& target, Context& context) {
  SetResult result;
  Listing listing(context, set_columns());
  for (const SetStep& step : plan.steps) {
    listing.add(step_record(step, Ending::unchanged, *step.before, target, context.clock));
    result.outcome.succeed();
  }
  result.counts = counts_of(plan.steps);
  return finish(listing, result.outcome, set_summary(result.counts, target.shown), context)
      .map([&](const Outcome&) { return result; });
}

/// Nothing was written to this tool; says so in its summary, too.
Result<SetResult> give_up(const ToolPlan& plan, const Target& target, const Error& error,
                          Context& context) {
  SetResult result;
  result.counts.left = plan.steps.size();
  result.outcome.fail(error);
  Listing listing(context, set_columns());
  listing.add(of_tool(target, error));
  return finish(listing, result.outcome, set_summary(result.counts, target.shown), context)
      .map([&](const Outcome&) { return result; });
}

Result<SetResult> write_tool(const ToolPlan& plan, const Target& target, Storing storing,
                             Context& context) {
  if (!plan.changes() && storing == Storing::no) return keep(plan, target, context);
  auto profile = load_profile(target, context);
  if (!profile) return give_up(plan, target, profile.error(), context);
  auto tool = open_tool(reopening(target), std::move(*profile), Need::named_registers, context);
  if (!tool) return give_up(plan, target, tool.error(), context);
  const auto steps = check_against_tool(plan.assignments(), tool->device);
  if (!steps) return give_up(plan, target, steps.error(), context);
  if (auto same = check_unchanged(plan, *steps, *tool); !same) {
    return give_up(plan, target, same.error(), context);
  }
  return SetWriter(*tool, storing, context).write(*steps);
}

Result<Outcome> write_all(const Ready& ready, const SetOptions& options, std::size_t of,
                          Context& context) {
  const auto performances =
      tape_each(ready.targets, options.jobs, context, [&](const Target& target, Context& own) {
        return write_tool(ready.plans.at(target.shown), target, options.storing, own);
      });
  Outcome outcome =
      outcome_of_all(performances, [](const SetResult& result) { return result.outcome; });
  outcome.add(ready.lost);
  SetCounts counts;
  std::size_t failed = of - ready.targets.size();
  counts.left = failed * options.assignments.size();
  for (std::size_t index = 0; index < performances.size(); ++index) {
    const Result<SetResult>& result = performances[index].result;
    if (result) counts.add(result->counts);
    if (!result) counts.left += ready.plans.at(ready.targets[index].shown).steps.size();
    if (!result || result->outcome.failed() > 0) ++failed;
  }
  Summary summary = set_summary(counts, {});
  summary.sentence += fmt::format(" on {}{}", counted(of, "tool"), failed_in_words(failed, of));
  return play(performances, context)
      .and_then([&] { return tell(std::move(summary), outcome, context); })
      .map([&] { return outcome; });
}

}  // namespace

Result<Outcome> set_group(const std::vector<Target>& targets, const SetOptions& options,
                          Context& context) {
  auto known = check_known(targets, context,
                           [&](const Profile& profile) { return understand(options, profile); });
  if (!known) return tl::unexpected(std::move(known.error()));
  const auto ready = make_ready(
      targets, options.jobs, context,
      [&](const Target& target, Context& own) { return plan_tool(target, options, own); });
  if (!ready) return tl::unexpected(ready.error());
  if (ready->refused.failed() > 0) {
    const SetCounts none{.left = targets.size() * options.assignments.size()};
    return refuse_all(ready->refused, set_summary(none, {}), targets.size(), context);
  }
  if (options.execution == Execution::dry_run) return end_dry_run(*ready, targets.size(), context);
  if (auto agreed = ask(*ready, options, targets.size(), context); !agreed) {
    return tl::unexpected(std::move(agreed.error()));
  }
  return write_all(*ready, options, targets.size(), context);
}

}  // namespace spindle::commands
