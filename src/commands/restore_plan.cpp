#include "restore_plan.hpp"

#include <fmt/format.h>

#include <utility>

#include "progress.hpp"
#include "restore_warnings.hpp"
#include "spindle/catalogue/snapshot_unit.hpp"
#include "spindle/work/change.hpp"
#include "storing.hpp"

namespace spindle::commands {
namespace {

using catalogue::Profile;
using catalogue::Snapshot;

/// What cannot be read can be neither compared nor put back.
Result<Snapshot> read_present(const RestoreTask& task, OpenTool& tool, const Context& context) {
  ProgressLine progress(context);
  TRY_LET(auto present, take_snapshot(tool, Secrets::include, context,
                                      progress.counter(tool.target.shown + ": reading")));
  for (const Error& error : present.unreadable) {
    const auto* needed = task.backup.find(error.name);
    if (needed != nullptr && task.selection.contains(needed->parameter)) {
      return tl::unexpected(error);
    }
  }
  return std::move(present.snapshot);
}

std::string serial_of(const Snapshot& snapshot) {
  return snapshot.identity ? snapshot.identity->serial : std::string();
}

std::string in_words(const catalogue::Parameter& parameter,
                     const std::optional<catalogue::Value>& value) {
  return value ? shown_of(parameter, *value) : "nothing";
}

}  // namespace

bool changes_by_itself(const catalogue::Parameter& parameter) {
  return parameter.access == catalogue::Access::read_only;
}

Result<RestoreTask> plan_by_profile(const files::BackupFile& file, const RestoreOptions& options,
                                    const Profile& profile) {
  TRY(check_storing(options.storing, profile));
  TRY_LET(auto backup, files::resolve_backup(file, profile));
  TRY_LET(auto selection, catalogue::Selection::make(options.patterns, {}, profile));
  TRY(catalogue::check_own_unit(backup, profile, selection));
  return RestoreTask{
      .file = file.path, .backup = std::move(backup), .selection = std::move(selection)};
}

Result<RestoreTask> plan_by_tool(RestoreTask task, OpenTool& tool, const RestoreOptions& options,
                                 const Context& context) {
  TRY_LET(auto present, read_present(task, tool, context));
  task.present = std::move(present);
  const Profile& profile = tool.device.profile();
  const bool is_strict = options.model == ModelCheck::strict || profile.has_guarded();
  if (auto same = check_model(task, profile); is_strict && !same) {
    return tl::unexpected(std::move(same.error()));
  }
  task.destination = catalogue::destination_of(task.backup, task.present);
  task.plan = catalogue::plan_restore(
      task.backup, task.present, profile, task.selection, task.destination,
      is_strict ? catalogue::UnitRule::strict : catalogue::UnitRule::ignored);
  task.warnings = warnings_for(task, profile);
  return task;
}

Result<RestoreTask> confirm_unchanged(const RestoreTask& task, OpenTool& tool,
                                      const RestoreOptions& options, const Context& context) {
  auto now = plan_by_tool(task, tool, options, context);
  if (!now) return now;
  const std::string before = serial_of(task.present);
  if (const std::string serial = serial_of(now->present); serial != before) {
    return tl::unexpected(work::changed_meanwhile(
        fmt::format("serial {} answers now, and it was {} that was planned for", serial, before)));
  }
  const auto changed = catalogue::compare(task.present, now->present, {});
  for (const catalogue::Difference& difference : changed.differences) {
    if (changes_by_itself(difference.parameter)) continue;
    return tl::unexpected(work::changed_meanwhile(
        fmt::format("{} changed meanwhile from {} to {}", difference.parameter.name,
                    in_words(difference.parameter, difference.a),
                    in_words(difference.parameter, difference.b))));
  }
  if (!now->plan.findings.empty()) return tl::unexpected(now->plan.findings.front());
  return now;
}

}  // namespace spindle::commands
