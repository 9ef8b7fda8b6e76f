#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <utility>

#include "consent.hpp"
#include "run_verb.hpp"
#include "set_plan.hpp"
#include "set_records.hpp"
#include "set_request.hpp"
#include "set_writer.hpp"
#include "spindle/base/text.hpp"
#include "spindle/commands/commands.hpp"
#include "storing.hpp"
#include "undo_plan.hpp"

namespace spindle::commands {
namespace {

using catalogue::Profile;

class Set final : public Verb<SetPlan, SetResult> {
 public:
  Set(const SetOptions& options, const SetRequest& request, bool is_group)
      : options_(&options), request_(&request), is_group_(is_group) {}

  [[nodiscard]] Fit fit() const override { return Fit::all; }
  [[nodiscard]] bool changes_tools() const override { return true; }
  /// Where no names are used nothing has to be known of the registers.
  [[nodiscard]] Need need() const override { return request_->need(); }
  [[nodiscard]] Basis basis() const override { return Basis::tool; }

  Result<Plan> plan(const Profile& profile, const Target& target) const override {
    const auto torque =
        profile.torque_unit_from.empty() ? TorqueUnit::known : TorqueUnit::told_by_tool;
    TRY_LET(auto assignments, request_->parse(profile, target, torque));
    return check_storing(options_->storing, profile).map([&] {
      return SetPlan{.assignments = std::move(assignments)};
    });
  }

  Result<Plan> examine(OpenTool& tool, Plan plan, Context& context) const override {
    if (!tool.profile->torque_unit_from.empty()) {
      TRY_LET(auto told, request_->parse(*tool.profile, tool.target, TorqueUnit::known));
      plan.assignments = std::move(told);
    }
    TRY_LET(auto steps, options_->addressing == Addressing::broadcast
                            ? steps_for_everybody(plan.assignments)
                            : check_against_tool(plan.assignments, tool.device));
    plan.steps = std::move(steps);
    plan.serial = serial_of(tool.device);
    if (options_->undoing) {
      TRY(check_undo(plan, *options_->undoing, tool));
      tell_doubts(plan, *options_->undoing, tool.target, context);
    }
    tell_other_steps(plan.steps, tool.device.profile(), tool.target, context);
    tell_roundings(plan.steps, tool.target, context);
    return plan;
  }

  Result<void> ask(const AllPlanned& planned, std::size_t of, Context& context) const override {
    if (is_dry_run()) return {};
    if (is_group_) return ask_for_group(planned, of, context);
    std::vector<std::string_view> what;
    if (options_->addressing == Addressing::broadcast) what.emplace_back("set");
    if (stores()) what.emplace_back(store_action);
    const std::string raw =
        options_->raw == RawWrites::ask ? raw_in_words(request_->texts()) : std::string();
    if (!raw.empty()) what.emplace_back(raw);
    if (what.empty()) return {};
    return ask_consent(fmt::format("{} on {}", fmt::join(what, ", "), planned.front().target.shown),
                       context);
  }

  Result<Plan> confirm(OpenTool& tool, const Plan& plan, Context& /*context*/) const override {
    return confirm_plan(plan, tool.device);
  }

  [[nodiscard]] bool needs_tool(const Plan& plan) const override {
    return !is_dry_run() &&
           (stores() || plan.changes() || options_->addressing == Addressing::broadcast);
  }

  Result<Done> conclude(const Target& target, const Plan& plan, Context& context) const override {
    const bool planned = is_dry_run();
    SetResult result{.counts = counts_of(plan.steps)};
    Listing listing(context, planned ? set_plan_columns() : set_columns());
    for (const SetStep& step : plan.steps) {
      listing.add(planned
                      ? planned_step_record(step, target, context.clock)
                      : step_record(step, Ending::unchanged, *step.before, target, context.clock));
      result.outcome.succeed();
    }
    Summary summary = planned ? plan_summary(result.counts, target.shown)
                              : set_summary(result.counts, target.shown);
    if (planned && !is_group_) summary.sentence += nothing_written;
    return finish(listing, result.outcome, std::move(summary), context).map([&](const Outcome&) {
      return result;
    });
  }

  Result<Done> perform(OpenTool& tool, const Plan& plan, Context& context) const override {
    TRY(ask_of_guarded(tool, plan, context));
    SetWriter writer(request_->log_for(tool, context), tool, options_->storing, context);
    if (!is_group_) tell_risks(plan.steps, tool.target, context);
    return options_->addressing == Addressing::broadcast ? writer.send(plan.steps)
                                                         : writer.write(plan.steps);
  }

  /// Nothing was written to this tool; its summary says so, too.
  Result<Done> give_up(const Target& target, const Plan* plan, const Error& error,
                       Context& context) const override {
    SetResult result;
    result.counts.left = plan != nullptr ? plan->steps.size() : request_->texts_for(target).size();
    result.outcome.fail(error);
    Listing listing(context, set_columns());
    listing.add(error);
    return finish(listing, result.outcome, set_summary(result.counts, target.shown), context)
        .map([&](const Outcome&) { return result; });
  }

  [[nodiscard]] std::optional<Summary> summary(const AllDone& all) const override {
    SetCounts counts;
    std::size_t failed = all.tools - all.planned.size();
    const bool planned = is_dry_run() && !all.is_rejected;
    if (!planned) counts.left = request_->left_of_others(all);
    for (std::size_t index = 0; index < all.done.size(); ++index) {
      const Result<SetResult>& done = all.done[index];
      done ? counts.add(done->counts) : counts.add({.left = all.planned[index].plan.steps.size()});
      if (!done || done->outcome.failed() > 0) ++failed;
    }
    Summary summary = planned ? plan_summary(counts, {}) : set_summary(counts, {});
    summary.sentence +=
        fmt::format(" on {}{}", counted(all.tools, "tool"), failed_in_words(failed, all.tools));
    if (planned) summary.sentence += nothing_written;
    return request_->with_change_of(std::move(summary), all.done);
  }

 private:
  static constexpr std::string_view nothing_written = "; nothing was written (dry run)";

  [[nodiscard]] bool is_dry_run() const { return options_->execution == Execution::dry_run; }
  [[nodiscard]] bool stores() const { return options_->storing == Storing::yes; }

  /// What is guarded is known only once the tool has said what it holds. Several tools were asked
  /// about together.
  Result<void> ask_of_guarded(OpenTool& tool, const Plan& plan, Context& context) const {
    const std::string guarded = guarded_in_words(plan.steps);
    if (guarded.empty() || is_group_) return {};
    TRY(ask_away_from(tool, fmt::format("{} on {}", guarded, tool.target.shown), context));
    return confirm_plan(plan, tool.device).map([](const Plan&) {});
  }

  /// The user sees first what the question is about.
  Result<void> ask_for_group(const AllPlanned& planned, std::size_t of, Context& context) const {
    SetCounts counts;
    std::vector<std::string> names;
    for (const auto& [target, plan] : planned) {
      tell_risks(plan.steps, target, context);
      counts.add(counts_of(plan.steps));
      if (stores() || plan.changes()) names.push_back(target.shown);
    }
    if (names.empty()) return {};
    if (can_ask(context)) {
      TRY(show_set_plans(planned, context));
    }
    return ask_consent(fmt::format("write {} to {}{}", counted(counts.changed, "value"),
                                   tools_in_words(names, of), stores() ? ", and save" : ""),
                       context);
  }

  const SetOptions* options_;
  const SetRequest* request_;
  bool is_group_;
};

}  // namespace

/// In a group all tools are read and checked before the first write, one question stands for all,
/// and each is opened again to be written if it is still as it was shown: no line is held while the
/// user thinks about the question.
Result<Outcome> set(const SetOptions& options, Context& context) {
  TRY_LET(const auto texts, texts_to_set(options, context));
  return resolve_one_or_group(options.targets, options.addressing, context)
      .and_then([&](Targets targets) {
        targets.is_group = targets.is_group || options.undoing;  // it is shown, and asked about
        const SetRequest request(options, texts, targets.tools, context);
        const Set verb(options, request, targets.is_group);
        return run_verb(verb, reopening(std::move(targets)), options.jobs, context);
      });
}

}  // namespace spindle::commands
