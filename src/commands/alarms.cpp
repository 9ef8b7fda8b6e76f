#include <fmt/format.h>

#include "actions.hpp"
#include "alarm_report.hpp"
#include "change_log.hpp"
#include "listing.hpp"
#include "records.hpp"
#include "run_verb.hpp"
#include "spindle/base/text.hpp"
#include "spindle/commands/commands.hpp"

namespace spindle::commands {
namespace {

using catalogue::Profile;

struct AlarmPlan {
  std::vector<AlarmSource> sources;
  std::optional<ActionRequest> reset = std::nullopt;
};

/// Nothing that is sent ends such an alarm, and its cause has to be dealt with first.
Error not_resettable(const AlarmReport& report) {
  return {.code = Errc::negative,
          .message = fmt::format("alarm {} cannot be reset by command, nothing was sent",
                                 report.present.to_string()),
          .hint = "remove its cause, then switch the tool off and on"};
}

Summary summary_of(report::Cell present, const Outcome& outcome, std::string sentence,
                   const std::string& target) {
  return {.counts = {{"present", std::move(present)}, {"failed", count(outcome.failed())}},
          .sentence = std::move(sentence),
          .target = target};
}

Result<ActionRequest> plan_reset(const Profile& profile, const Target& target,
                                 Acceptance acceptance) {
  if (profile.alarm_reset.empty()) {
    return tl::unexpected(
        Error{.code = Errc::usage,
              .message = fmt::format("profile {} has no action that resets alarms", profile.id),
              .hint = "'alarm-reset' in the profile names it, see spindle-profile(5)"});
  }
  return parse_action(profile.alarm_reset, profile).and_then([&](ActionRequest request) {
    return check_evidence(request.action, target, acceptance).map([&] {
      return std::move(request);
    });
  });
}

/// How many tools of a group had an alarm, have one still, do not say, and could not be examined or
/// reset.
struct Tally {
  std::size_t present = 0;
  std::size_t remaining = 0;
  std::size_t unknown = 0;
  std::size_t failed = 0;
};

std::string sentence_of(const Tally& tally, std::size_t failed, std::size_t of) {
  std::string found = tally.remaining == 0
                          ? std::string("no alarm present")
                          : fmt::format("alarms on {} of {}", tally.remaining, counted(of, "tool"));
  if (tally.unknown > 0) {
    const std::string unknown =
        fmt::format("not known of {} of {}", tally.unknown, counted(of, "tool"));
    found = tally.remaining == 0 && tally.unknown == of ? unknown : found + ", " + unknown;
  }
  return found + failed_in_words(failed, of);
}

Tally tally_of(const std::vector<Result<AlarmReport>>& reports) {
  Tally tally;
  for (const auto& report : reports) {
    if (report && report->was_present()) ++tally.present;
    if (report && !report->is_known()) ++tally.unknown;
    if (report && report->is_present()) ++tally.remaining;
    if (!report || report->outcome.failed() > 0) ++tally.failed;
  }
  return tally;
}

/// The alarms of a tool and, where it is wanted, their reset.
class Alarms final : public Verb<AlarmPlan, AlarmReport> {
 public:
  Alarms(const AlarmsOptions& options, bool is_group) : options_(&options), is_group_(is_group) {}

  [[nodiscard]] bool changes_tools() const override { return options_->reset == AlarmReset::yes; }

  Result<Plan> plan(const Profile& profile, const Target& target) const override {
    TRY_LET(auto sources, alarm_sources(profile));
    AlarmPlan plan{std::move(sources)};
    if (!changes_tools()) return plan;
    return plan_reset(profile, target, options_->acceptance).map([&](ActionRequest reset) {
      plan.reset = std::move(reset);
      return std::move(plan);
    });
  }

  Result<void> ask(const AllPlanned& planned, std::size_t of, Context& context) const override {
    PlannedRequests resets;
    for (const auto& [target, plan] : planned) {
      if (plan.reset) resets.push_back({target, {*plan.reset}});
    }
    if (resets.empty()) return {};
    if (is_group_) return ask_for_group(resets, of, context);
    return ask_for_hazards(resets.front().plan, resets.front().target, context);
  }

  Result<Done> perform(OpenTool& tool, const Plan& plan, Context& context) const override {
    AlarmReport report;
    work::ChangeLog log = change_log("alarms", tool, context);
    auto done = show_alarms(plan.sources, tool, report, context);
    if (done && plan.reset) done = reset(*plan.reset, tool, report, log, context);
    if (!done) return tl::unexpected(std::move(done.error()));
    const report::Cell present =
        report.is_known() ? count(report.was_present() ? 1 : 0) : report::Cell();
    Summary summary = summary_of(present, report.outcome, sentence_of(report), tool.target.shown);
    return tell(with_change(std::move(summary), log), report.outcome, context).map([&] {
      return report;
    });
  }

  [[nodiscard]] std::optional<Summary> summary(const AllDone& all) const override {
    const Tally tally = tally_of(all.done);
    const std::size_t failed = all.tools - all.done.size() + tally.failed;
    return summary_of(count(tally.present), all.outcome, sentence_of(tally, failed, all.tools), {});
  }

 private:
  /// The notes about a group were told when it was asked about.
  Result<void> reset(const ActionRequest& request, OpenTool& tool, AlarmReport& report,
                     work::ChangeLog& log, Context& context) const {
    if (report.is_present() && report.resettable == catalogue::Resettable::no) {
      return tl::unexpected(not_resettable(report));
    }
    if (!is_group_) tell_notes(request, tool.target, context);
    const auto result = perform_recorded(request, tool, log, context);
    if (!result) return tl::unexpected(result.error());
    Listing listing(context, performed_columns());
    listing.add(performed_record(request, *result, tool.target, context.clock));
    report.reset = AlarmReport::Reset::done;
    if (result == device::ActionResult::not_confirmed) {
      const Error error = not_confirmed(request);
      report.reset = AlarmReport::Reset::failed;
      report.outcome = {};  // the reset is what was asked for
      report.outcome.fail(error);
      listing.add(error);
    }
    return listing.end();
  }

  const AlarmsOptions* options_;
  bool is_group_;
};

}  // namespace

Result<Outcome> alarms(const AlarmsOptions& options, Context& context) {
  return resolve_one_or_group(options.targets, Addressing::unicast, context)
      .and_then([&](const Targets& targets) {
        return run_verb(Alarms(options, targets.is_group), targets, options.jobs, context);
      });
}

}  // namespace spindle::commands
