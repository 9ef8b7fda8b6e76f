#include <fmt/format.h>

#include <utility>

#include "consent.hpp"
#include "records.hpp"
#include "restore_run.hpp"
#include "restore_warnings.hpp"
#include "spindle/base/text.hpp"
#include "spindle/files/backup_file.hpp"
#include "storing.hpp"

namespace spindle::commands {
namespace {

using catalogue::Profile;
using catalogue::Skip;
using catalogue::Snapshot;

std::string counts_of(const RestoreTask& task) {
  std::string text = fmt::format("{} to write, {} unchanged", task.plan.writes.size(),
                                 task.plan.count(Skip::equal));
  const std::size_t skipped = task.plan.skipped.size() - task.plan.count(Skip::equal);
  if (skipped > 0) text += fmt::format(", {} skipped", skipped);
  return text;
}

/// Refuses the whole plan and says everything that is wrong with it.
Result<Outcome> refuse(const RestoreTask& task, const Target& target, Context& context) {
  Outcome outcome;
  Listing listing(context, restore_columns());
  for (const Error& finding : task.plan.findings) {
    outcome.fail(finding);
    listing.add(with_target(finding, target));
  }
  return finish(listing, outcome);
}

Result<void> show_plan(const RestoreTask& task, const Target& target, Context& context) {
  Listing listing(context, restore_columns());
  for (const auto& write : task.plan.writes) {
    listing.add(plan_record(write, target, context.clock));
  }
  return listing.end();
}

Result<Outcome> end_dry_run(const RestoreTask& task, const Target& target, Context& context) {
  Outcome outcome;
  outcome.succeed();
  const std::size_t unchanged = task.plan.count(Skip::equal);
  return show_plan(task, target, context)
      .and_then([&] {
        return context.renderer.summary(
            summary_record({{"planned", count(task.plan.writes.size())},
                            {"unchanged", count(unchanged)},
                            {"skipped", count(task.plan.skipped.size() - unchanged)}},
                           outcome.status(), target.shown, context.clock),
            counts_of(task) + "; nothing was written (dry run)");
      })
      .map([&] { return outcome; });
}

/// Whoever is asked sees first what it is about.
Result<void> ask(const RestoreTask& task, const RestoreOptions& options, const Target& target,
                 Context& context) {
  const bool stores = options.storing == Storing::yes;
  if (task.plan.writes.empty() && !stores) return {};
  context.renderer.note(fmt::format("{}: {}", target.shown, counts_of(task)));
  if (can_ask(context)) {
    if (auto shown = show_plan(task, target, context); !shown) return shown;
  }
  return ask_consent(fmt::format("write {} to {}{}", counted(task.plan.writes.size(), "parameter"),
                                 target.shown, stores ? ", and save" : ""),
                     context);
}

/// A backup with what it means, and what of it is wanted.
struct Wanted {
  Snapshot backup;
  catalogue::Selection selection;
};

Result<Wanted> understand(const files::BackupFile& file, const RestoreOptions& options,
                          const Profile& profile) {
  if (auto storing = check_storing(options.storing, profile); !storing) {
    return tl::unexpected(std::move(storing.error()));
  }
  auto backup = files::understand_backup(file, profile);
  if (!backup) return tl::unexpected(std::move(backup.error()));
  auto selection = catalogue::Selection::make(options.patterns, {}, profile);
  if (!selection) return tl::unexpected(std::move(selection.error()));
  return Wanted{std::move(*backup), std::move(*selection)};
}

Result<RestoreTask> plan(Wanted wanted, OpenTool& tool, const RestoreOptions& options,
                         Context& context) {
  ProgressLine progress(context);
  auto present = take_snapshot(tool, Secrets::include, context,
                               progress.counter(tool.target.shown + ": reading"));
  if (!present) return tl::unexpected(std::move(present.error()));
  for (const Error& error : present->unreadable) {
    const auto* needed = wanted.backup.find(error.name);
    if (needed != nullptr && wanted.selection.contains(needed->parameter)) {
      return tl::unexpected(error);
    }
  }
  RestoreTask task;
  task.backup = std::move(wanted.backup);
  task.present = std::move(present->snapshot);
  task.selection = std::move(wanted.selection);
  auto same = check_model(task.backup, task.present, options);
  if (!same) return tl::unexpected(std::move(same.error()));
  task.destination = catalogue::destination_of(task.backup, task.present);
  task.plan = catalogue::plan_restore(
      task.backup, task.present, tool.device.profile(), task.selection, task.destination,
      options.model == ModelCheck::off ? catalogue::UnitRule::ignored
                                       : catalogue::UnitRule::strict);
  return task;
}

}  // namespace

Result<Outcome> restore(const RestoreOptions& options, Context& context) {
  const auto target = resolve_target(
      options.target, context,
      {.why = "a backup is restored to one", .instead = "restore them one by one, beginning with"});
  if (!target) return tl::unexpected(target.error());
  const auto file = read_backup_file(options.file, context);
  if (!file) return tl::unexpected(file.error());
  auto opened = open_prepared(*target, Need::named_registers, context, [&](const Profile& profile) {
    return understand(*file, options, profile);
  });
  if (!opened) return tl::unexpected(std::move(opened.error()));
  OpenTool& tool = opened->tool;
  const auto task = plan(std::move(opened->prepared), tool, options, context);
  if (!task) return tl::unexpected(with_target(task.error(), tool.target));
  for (const std::string& warning : warnings_for(*task, tool.device.profile())) {
    context.renderer.note("warning: " + warning);
  }
  if (!task->plan.findings.empty()) return refuse(*task, tool.target, context);
  if (options.execution == Execution::dry_run) return end_dry_run(*task, tool.target, context);
  if (auto agreed = ask(*task, options, tool.target, context); !agreed) {
    return tl::unexpected(std::move(agreed.error()));
  }
  return RestoreRun(options, *task, tool, context).run();
}

}  // namespace spindle::commands
