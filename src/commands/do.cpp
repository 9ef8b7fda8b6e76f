#include <fmt/format.h>

#include <optional>
#include <utility>

#include "change_log.hpp"
#include "deeds.hpp"
#include "group.hpp"
#include "listing.hpp"
#include "records.hpp"
#include "spindle/base/text.hpp"
#include "spindle/commands/commands.hpp"
#include "spindle/commands/target.hpp"

namespace spindle::commands {
namespace {

using catalogue::Action;
using catalogue::Hazard;
using catalogue::Profile;

/// A started motion needs somebody who stops it again, and this command ends at once.
Result<void> check_guard(const Deed& deed) {
  const bool starts = deed.action.motion == catalogue::Motion::start ||
                      (deed.action.stop_value && deed.value != *deed.action.stop_value);
  if (deed.action.hazard != Hazard::moves || !starts) return {};
  return tl::unexpected(
      Error{.code = Errc::usage,
            .message = "it starts a motion, and 'do' does not stay to stop it",
            .hint = "'spindle remote-start' starts it under a guard that always ends in a stop",
            .name = deed.action.name});
}

Result<std::vector<Deed>> check_deeds(const DoOptions& options, const Profile& profile,
                                      const Target& target) {
  std::vector<Deed> deeds;
  for (const std::string& text : options.actions) {
    auto deed = parse_deed(text, profile);
    if (!deed) return tl::unexpected(std::move(deed.error()));
    auto allowed = check_guard(*deed).and_then(
        [&] { return check_evidence(deed->action, target, options.acceptance); });
    if (!allowed) return tl::unexpected(std::move(allowed.error()));
    deeds.push_back(std::move(*deed));
  }
  return deeds;
}

Summary listed(const Outcome& outcome, const std::string& target) {
  return {.counts = {{"actions", count(outcome.succeeded())}},
          .sentence = counted(outcome.succeeded(), "action"),
          .target = target};
}

Result<Outcome> list_actions(const Target& target, Context& context) {
  auto profile = load_profile(target, context);
  if (!profile) return tl::unexpected(std::move(profile.error()));
  if (target.profile.empty()) {
    auto tool = open_tool(target, catalogue::Profile(), Need::named_registers, context);
    if (!tool) return tl::unexpected(std::move(tool.error()));
    *profile = tool->device.profile();
  }
  Outcome outcome;
  Listing listing(context, action_columns());
  for (const Action& action : profile->actions) {
    listing.add(action_record(action, target.shown, context.clock));
    outcome.succeed();
  }
  return finish(listing, outcome, listed(outcome, target.shown), context);
}

Summary summary_of(const Outcome& outcome, Reach reach, const std::string& target) {
  const bool everybody = reach == Reach::everybody;
  return {.counts = {{everybody ? "sent" : "done", count(outcome.succeeded())},
                     {"failed", count(outcome.failed())}},
          .sentence = fmt::format("{} {}, {} failed", outcome.succeeded(),
                                  everybody ? "sent, not acknowledged" : "done", outcome.failed()),
          .target = target};
}

/// Why a deed that was begun did not succeed.
std::optional<Error> failure_of(const Deed& deed, const Result<device::ActionResult>& result,
                                const Target& target) {
  if (result == device::ActionResult::not_confirmed) return not_confirmed(deed, target);
  if (result) return std::nullopt;
  Error error = result.error();
  if (is_interruption(error)) {
    error.name = deed.action.name;
    error.hint = "whether it was done is not known: look at the tool";
  }
  return error;
}

/// Whether their notes were told when somebody was asked.
enum class Notes : std::uint8_t { to_tell, told };

/// Carries the deeds out in order and stops at the first that fails: later ones may rest on it.
Result<Outcome> carry_out(const std::vector<Deed>& deeds, OpenTool& tool, Notes notes,
                          Context& context) {
  Outcome outcome;
  Listing listing(context, deed_columns());
  work::ChangeLog log = change_log("do", tool, context);
  for (const Deed& deed : deeds) {
    std::optional<Error> error;
    if (context.interrupt.signalled()) {
      error = tool.target.blamed(context.interrupt.error());
    } else {
      if (notes == Notes::to_tell) tell_notes(deed, tool.target, context);
      const auto result = perform_recorded(deed, tool, log, context);
      if (result) listing.add(deed_record(deed, *result, tool.target, context.clock));
      error = failure_of(deed, result, tool.target);
    }
    if (error) {
      outcome.fail(*error);
      listing.add(*error);
      break;
    }
    outcome.succeed();
  }
  return finish(listing, outcome, summary_of(outcome, tool.target.reach, tool.target.shown),
                context);
}

Result<Outcome> perform_on_one(const Target& target, const DoOptions& options, Context& context) {
  auto opened = open_prepared(target, Need::named_registers, context, [&](const Profile& profile) {
    return check_deeds(options, profile, target).and_then([&](std::vector<Deed> deeds) {
      return ask_for_hazards(deeds, target, context).map([&] { return std::move(deeds); });
    });
  });
  if (!opened) return tl::unexpected(std::move(opened.error()));
  return carry_out(opened->prepared, opened->tool, Notes::to_tell, context);
}

Result<Outcome> list_for_group(const std::vector<Target>& targets, const DoOptions& options,
                               Context& context) {
  const auto performances =
      tape_each(targets, options.jobs, context,
                [](const Target& target, Context& own) { return list_actions(target, own); });
  const Outcome outcome = outcome_of_all(performances);
  Summary summary = listed(outcome, {});
  summary.sentence += " of " + counted(targets.size(), "tool");
  return play(performances, context)
      .and_then([&] { return tell(std::move(summary), outcome, context); })
      .map([&] { return outcome; });
}

/// Nothing is sent to any tool before all of it is known to fit, and somebody agreed.
Result<Outcome> perform_on_group(const std::vector<Target>& targets, const DoOptions& options,
                                 Context& context) {
  auto ready = make_ready(targets, options.jobs, context, [&](const Target& target, Context& own) {
    return plan_by_profile(
        target, own, [&](const Profile& profile) { return check_deeds(options, profile, target); });
  });
  if (!ready) return tl::unexpected(std::move(ready.error()));
  if (ready->refused.failed() > 0) {
    return refuse_all(ready->refused, summary_of(ready->refused, Reach::one, {}), targets.size(),
                      context);
  }
  auto agreed = ask_for_group(ready->targets, ready->plans, targets.size(), context);
  if (!agreed) return tl::unexpected(std::move(agreed.error()));
  const auto perform_one = [&](const Target& target, Context& own) -> Result<Outcome> {
    auto profile = load_profile(target, own);
    if (!profile) return tl::unexpected(std::move(profile.error()));
    auto tool = open_tool(target, std::move(*profile), Need::named_registers, own);
    if (!tool) return tl::unexpected(std::move(tool.error()));
    return carry_out(ready->plans.at(target.shown), *tool, Notes::told, own);
  };
  const auto performances = tape_each(ready->targets, options.jobs, context, perform_one);
  Outcome outcome = outcome_of_all(performances);
  outcome.add(ready->lost);
  Summary summary = summary_of(outcome, Reach::one, {});
  summary.sentence += " on " + counted(targets.size(), "tool");
  return play(performances, context)
      .and_then([&] { return tell(std::move(summary), outcome, context); })
      .map([&] { return outcome; });
}

}  // namespace

Result<Outcome> perform(const DoOptions& options, Context& context) {
  const auto targets = resolve_one_or_group(options.target, options.reach, context);
  if (!targets) return tl::unexpected(targets.error());
  const bool listing = options.actions.empty();
  if (is_group(options.target, options.reach)) {
    return listing ? list_for_group(*targets, options, context)
                   : perform_on_group(*targets, options, context);
  }
  return listing ? list_actions(targets->front(), context)
                 : perform_on_one(targets->front(), options, context);
}

}  // namespace spindle::commands
