#include <fmt/format.h>

#include <optional>
#include <utility>

#include "actions.hpp"
#include "change_log.hpp"
#include "find_block.hpp"
#include "listing.hpp"
#include "records.hpp"
#include "run_verb.hpp"
#include "spindle/base/text.hpp"
#include "spindle/commands/commands.hpp"

namespace spindle::commands {
namespace {

using catalogue::Action;
using catalogue::Hazard;
using catalogue::Profile;

/// A started motion needs a command that stops it again, and this command ends at once.
Result<void> check_guard(const ActionRequest& request, const Profile& profile) {
  const bool starts = request.action.motion == catalogue::Motion::start ||
                      (request.action.stop_value && request.value != *request.action.stop_value);
  if (request.action.hazard != Hazard::moves || !starts) return {};
  return tl::unexpected(Error{
      .code = Errc::usage,
      .message = "it starts a motion, and 'do' does not stay to stop it",
      .hint = profile.is_guarded_start(request.action.name)
                  ? "'spindle remote-start' starts it under a guard that always ends in a stop"
                  : "",
      .name = request.action.name,
      .remedy = {.right = profile.is_guarded_start(request.action.name)
                              ? "spindle remote-start TARGET"
                              : ""}});
}

Result<std::vector<ActionRequest>> check_deeds(const DoOptions& options, const Profile& profile,
                                               const Target& target) {
  std::vector<ActionRequest> requests;
  for (const std::string& text : options.actions) {
    TRY_LET(auto request, parse_action(text, profile));
    auto allowed = check_guard(request, profile).and_then([&] {
      return check_evidence(request.action, target, options.acceptance);
    });
    if (!allowed) return tl::unexpected(std::move(allowed.error()));
    requests.push_back(std::move(request));
  }
  return requests;
}

Summary listed(const Outcome& outcome, const std::string& target) {
  return {.counts = {{"actions", count(outcome.succeeded())}},
          .sentence = counted(outcome.succeeded(), "action"),
          .target = target};
}

Result<Outcome> list_actions(const Target& target, Context& context) {
  TRY_LET(auto profile, load_profile(target, context));
  if (target.profile.empty()) {
    TRY_LET(auto tool, open_to_read(target, catalogue::Profile(), context));
    profile = tool.device.profile();
  }
  Outcome outcome;
  Listing listing(context, action_columns());
  for (const Action& action : profile.actions) {
    listing.add(action_record(action, target.shown, context.clock));
    outcome.succeed();
  }
  const std::string search = search_in_words(profile, target);
  if (!search.empty()) context.renderer.note(search);
  return finish(listing, outcome, listed(outcome, target.shown), context);
}

Summary summary_of(const Outcome& outcome, Addressing addressing, const std::string& target) {
  const bool everybody = addressing == Addressing::broadcast;
  return {.counts = {{everybody ? "sent" : "done", count(outcome.succeeded())},
                     {"failed", count(outcome.failed())}},
          .sentence = fmt::format("{} {}, {} failed", outcome.succeeded(),
                                  everybody ? "sent, not acknowledged" : "done", outcome.failed()),
          .target = target};
}

/// Why a request that was begun did not succeed.
std::optional<Error> failure_of(const ActionRequest& request,
                                const Result<device::ActionResult>& result) {
  if (result == device::ActionResult::not_confirmed) return not_confirmed(request);
  if (result) return std::nullopt;
  Error error = result.error();
  if (work::is_interruption(error)) {
    error.name = request.action.name;
    error.hint = "whether it was done is not known: look at the tool";
  }
  return error;
}

/// Carries actions out in order and stops at the first that fails: later ones may rest on it.
class Do final : public Verb<std::vector<ActionRequest>, Outcome> {
 public:
  Do(const DoOptions& options, bool is_group) : options_(&options), is_group_(is_group) {}

  [[nodiscard]] bool changes_tools() const override { return true; }

  [[nodiscard]] std::string_view otherwise(const std::string& word,
                                           const Profile& profile) const override {
    return profile.find_action(word) ? "an action" : "";
  }

  Result<Plan> plan(const Profile& profile, const Target& target) const override {
    return check_deeds(*options_, profile, target);
  }

  Result<void> ask(const AllPlanned& planned, std::size_t of, Context& context) const override {
    if (is_group_) return ask_for_group(planned, of, context);
    return ask_for_hazards(planned.front().plan, planned.front().target, context);
  }

  Result<Done> perform(OpenTool& tool, const Plan& plan, Context& context) const override {
    Outcome outcome;
    Listing listing(context, performed_columns());
    work::ChangeLog log = change_log("do", tool, context);
    for (const ActionRequest& request : plan) {
      if (const auto error = carry_out(request, tool, log, listing, context)) {
        outcome.fail(*error);
        listing.add(*error);
        break;
      }
      outcome.succeed();
    }
    return finish(listing, outcome,
                  with_change(summary_of(outcome, tool.target.addressing, tool.target.shown), log),
                  context);
  }

  [[nodiscard]] std::optional<Summary> summary(const AllDone& all) const override {
    Summary summary = summary_of(all.outcome, Addressing::unicast, {});
    summary.sentence += " on " + counted(all.tools, "tool");
    return summary;
  }

 private:
  /// Why it did not succeed. The notes about a group were told when it was asked about.
  std::optional<Error> carry_out(const ActionRequest& request, OpenTool& tool, work::ChangeLog& log,
                                 Listing& listing, const Context& context) const {
    if (context.interrupt.signalled()) return context.interrupt.error();
    if (!is_group_) tell_notes(request, tool.target, context);
    const auto result = perform_recorded(request, tool, log, context);
    if (result) listing.add(performed_record(request, *result, tool.target, context.clock));
    return failure_of(request, result);
  }

  const DoOptions* options_;
  bool is_group_;
};

Result<Outcome> list_all_actions(const Targets& targets, const DoOptions& options,
                                 Context& context) {
  if (!targets.is_group) return list_actions(targets.tools.front(), context);
  RecordedOutput output(targets.tools.size(), context.renderer);
  const auto results = for_each_told(
      targets.tools, options.jobs, output, context, [](const Target& target, Context& own) {
        return begin_turn(target, own).and_then([&] { return list_actions(target, own); });
      });
  const Outcome outcome = outcome_of_all(results);
  Summary summary = listed(outcome, {});
  summary.sentence += " of " + counted(targets.tools.size(), "tool");
  return end_group(output, std::move(summary), outcome, context);
}

}  // namespace

Result<Outcome> perform(const DoOptions& options, Context& context) {
  return resolve_one_or_group(options.targets, options.addressing, context)
      .and_then([&](const Targets& targets) {
        if (options.actions.empty()) return list_all_actions(targets, options, context);
        if (wants_search(options, targets, context)) return find_block(options, targets, context);
        return run_verb(Do(options, targets.is_group), targets, options.jobs, context);
      });
}

}  // namespace spindle::commands
