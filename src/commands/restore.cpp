#include <fmt/format.h>
#include <fmt/ranges.h>

#include <utility>

#include "backup_paths.hpp"
#include "consent.hpp"
#include "restore_run.hpp"
#include "run_verb.hpp"
#include "spindle/base/text.hpp"
#include "spindle/catalogue/short_name.hpp"

namespace spindle::commands {
namespace {

/// What it refers to does not change while it runs.
class Restore final : public Verb<RestoreTask, RestoreResult> {
 public:
  Restore(const RestoreOptions& options, const Backups& backups, const CommonRun& run, bool group)
      : options_(&options), backups_(&backups), run_(&run), is_group_(group) {}

  [[nodiscard]] Fit fit() const override { return Fit::all; }
  [[nodiscard]] bool changes_tools() const override { return true; }
  [[nodiscard]] Basis basis() const override { return Basis::tool; }
  [[nodiscard]] Basis question_basis() const override { return Basis::tool; }
  std::string_view otherwise(const std::string& word,
                             const catalogue::Profile& profile) const override {
    return catalogue::is_meant(word, profile) ? "a parameter" : "";
  }

  Result<Plan> plan(const catalogue::Profile& profile, const Target& target) const override {
    return plan_by_profile(backups_->at(target.shown), *options_, profile);
  }

  /// All that is wrong for one tool of a group is told, and the last of it ends the command.
  Result<Plan> examine(OpenTool& tool, Plan plan, Context& context) const override {
    auto task = plan_by_tool(std::move(plan), tool, *options_, context);
    if (!task) return tl::unexpected(with_target(std::move(task.error()), tool.target));
    if (!is_group_ || task->plan.findings.empty()) return task;
    const Error last = task->plan.findings.back();
    task->plan.findings.pop_back();
    return tell_findings(*task, tool.target, context).and_then([&] {
      return Result<Plan>(tl::unexpected(with_target(last, tool.target)));
    });
  }

  /// The user sees first what the question is about.
  Result<void> ask(const AllPlanned& planned, std::size_t of, Context& context) const override {
    std::size_t writes = 0;
    std::vector<std::string> names;
    for (const auto& [target, task] : planned) {
      tell_warnings(task, target, context);
      if (!changes(task)) continue;
      context.renderer.note(fmt::format("{}: {}", target.shown, in_words(counts_of(task.plan))));
      writes += task.plan.writes.size();
      names.push_back(target.shown);
    }
    if (names.empty()) return {};
    if (can_ask(context)) TRY(show_plans(planned, context));
    return ask_consent(fmt::format("write {} to {}{}", counted(writes, "parameter"),
                                   is_group_ ? tools_in_words(names, of) : names.front(),
                                   stores() ? ", and save" : ""),
                       context);
  }

  Result<Plan> confirm(OpenTool& tool, const Plan& plan, Context& context) const override {
    return confirm_unchanged(plan, tool, *options_, context);
  }

  /// What the tool has no register for is told as part of the run.
  [[nodiscard]] bool needs_tool(const Plan& task) const override {
    return changes(task) || (is_carried_out(task) && task.plan.count(catalogue::Skip::absent) > 0);
  }

  Result<Done> conclude(const Target& target, const Plan& task, Context& context) const override {
    RestoreResult result{.counts = counts_of(task.plan)};
    for (const Error& finding : task.plan.findings) result.outcome.fail(finding);
    if (result.outcome.failed() > 0) {
      return tell_findings(task, target, context).map([&] { return result; });
    }
    result.outcome.succeed();
    Listing listing(context, restore_columns());
    add_plan(task, target, listing, context.clock);
    Summary summary = is_dry_run() ? restore_plan_summary(result.counts, target.shown)
                                   : restore_summary(result.counts, {}, target.shown);
    if (is_dry_run() && !is_group_) summary.sentence += nothing_written;
    return finish(listing, result.outcome, std::move(summary), context).map([&](const Outcome&) {
      return result;
    });
  }

  Result<Done> perform(OpenTool& tool, const Plan& plan, Context& context) const override {
    return RestoreRun(*options_, plan, tool, run_->of(tool.target), context).run();
  }

  /// Nothing was written to this tool; its summary says so, too.
  Result<Done> give_up(const Target& target, const Plan* plan, const Error& error,
                       Context& context) const override {
    if (plan == nullptr) return tl::unexpected(error);
    RestoreResult result{.counts = counts_of(plan->plan)};
    result.outcome.fail(error);
    Listing listing(context, restore_columns());
    listing.add(error);
    return finish(listing, result.outcome, restore_summary(result.counts, {}, target.shown),
                  context)
        .map([&](const Outcome&) { return result; });
  }

  [[nodiscard]] std::optional<Summary> summary(const AllDone& all) const override {
    RestoreCounts counts;
    std::size_t failed = all.tools - all.planned.size();
    for (std::size_t index = 0; index < all.done.size(); ++index) {
      const Result<RestoreResult>& done = all.done[index];
      counts.add(done ? done->counts : counts_of(all.planned[index].plan.plan));
      if (!done || done->outcome.failed() > 0) ++failed;
    }
    const bool planned = is_dry_run() && !all.is_rejected;
    Summary summary = planned ? restore_plan_summary(counts, {}) : restore_summary(counts, {}, {});
    if (counts.rolled_back > 0)
      summary.sentence += fmt::format(", {} rolled back", counts.rolled_back);
    summary.sentence +=
        fmt::format(" on {}{}", counted(all.tools, "tool"), failed_in_words(failed, all.tools));
    if (planned) summary.sentence += nothing_written;
    return with_change_of(std::move(summary), all.done, *run_);
  }

 private:
  static constexpr std::string_view nothing_written = "; nothing was written (dry run)";

  [[nodiscard]] bool is_dry_run() const { return options_->execution == Execution::dry_run; }
  [[nodiscard]] bool stores() const { return options_->storing == Storing::yes; }
  [[nodiscard]] bool is_carried_out(const RestoreTask& task) const {
    return !is_dry_run() && task.plan.findings.empty();
  }
  [[nodiscard]] bool changes(const RestoreTask& task) const {
    return is_carried_out(task) && (stores() || !task.plan.writes.empty());
  }

  void tell_warnings(const RestoreTask& task, const Target& target, Context& context) const {
    for (const std::string& warning : task.warnings) {
      const std::string tool = is_group_ ? target.shown + ": " : std::string();
      context.renderer.note(fmt::format("warning: {}{}", tool, warning));
    }
  }

  Result<void> show_plans(const AllPlanned& planned, Context& context) const {
    const auto columns = restore_columns();
    Listing listing(context, is_group_ ? with_target_column(columns)
                                       : std::vector(columns.begin(), columns.end()));
    for (const auto& [target, task] : planned) add_plan(task, target, listing, context.clock);
    return listing.end();
  }

  const RestoreOptions* options_;
  const Backups* backups_;
  const CommonRun* run_;
  bool is_group_;
};

Result<Backups> find_backups(const std::vector<Target>& tools, const RestoreOptions& options,
                             const Context& context) {
  if (!options.folder.empty()) {
    return check_names_only(options.patterns, context).and_then([&] {
      return read_backups(tools, options.folder, context);
    });
  }
  return read_backup_file(options.file, context).map([&](files::BackupFile file) {
    return Backups{{tools.front().shown, std::move(file)}};
  });
}

/// One file is the backup of one tool.
Result<Targets> resolve(const RestoreOptions& options, const Context& context) {
  auto targets = resolve_one_or_group(options.targets, Addressing::unicast, context);
  if (!targets || !options.folder.empty()) return targets;
  if (targets->tools.size() > 1) {
    return tl::unexpected(
        Error{.code = Errc::usage,
              .message = fmt::format("'{}' is {} tools, and one FILE is restored to one",
                                     fmt::join(options.targets, " "), targets->tools.size()),
              .hint = "--dir FOLDER restores each from its own backup in it"});
  }
  targets->is_group = context.user.choice == TargetChoice::by_default;
  return targets;
}

}  // namespace

/// All tools of a group are checked and asked about at once; each is then opened again, and written
/// if it is still as it was shown.
Result<Outcome> restore(const RestoreOptions& options, Context& context) {
  return resolve(options, context).and_then([&](const Targets& targets) {
    return find_backups(targets.tools, options, context).and_then([&](const Backups& all) {
      const CommonRun run("restore", targets.tools, context);
      return run_verb(Restore(options, all, run, targets.is_group), targets, options.jobs, context);
    });
  });
}

}  // namespace spindle::commands
