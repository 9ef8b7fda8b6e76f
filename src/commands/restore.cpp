#include <fmt/format.h>

#include <utility>

#include "consent.hpp"
#include "records.hpp"
#include "restore_run.hpp"
#include "spindle/base/text.hpp"
#include "spindle/catalogue/danger.hpp"
#include "spindle/files/backup_file.hpp"
#include "storing.hpp"

namespace spindle::commands {
namespace {

using catalogue::Profile;
using catalogue::Skip;
using catalogue::Snapshot;

std::string shown_model(const Snapshot& snapshot) {
  if (!snapshot.identity) return fmt::format("profile {}", snapshot.profile);
  const auto& [model, code, serial, firmware, raw] = *snapshot.identity;
  return model.empty() ? fmt::format("code {}", code.value_or(0)) : model;
}

/// The same model by its own code; where a product does not say it, by its profile.
bool is_same_model(const Snapshot& backup, const Snapshot& present) {
  if (!backup.identity || !present.identity) return backup.profile == present.profile;
  return backup.identity->model_code == present.identity->model_code;
}

Result<void> check_model(const Snapshot& backup, const Snapshot& present, const Target& target,
                         const RestoreOptions& options) {
  if (options.model == ModelCheck::off || is_same_model(backup, present)) return {};
  return tl::unexpected(
      target.blamed({.code = Errc::wrong_model,
                     .message = fmt::format("the backup is of a {}, and this tool is a {}",
                                            shown_model(backup), shown_model(present)),
                     .hint = "--force restores it all the same",
                     .name = options.file}));
}

std::string shown_firmware(const Snapshot& snapshot) {
  const bool known = snapshot.identity && snapshot.identity->firmware;
  return known ? std::to_string(*snapshot.identity->firmware) : std::string("unknown");
}

/// A torque in another unit is another torque.
const catalogue::PlannedWrite* find_other_unit(const RestoreTask& task) {
  for (const catalogue::PlannedWrite& write : task.plan.writes) {
    const auto* entry = task.backup.find(write.parameter.name);
    const auto sides = task.destination == catalogue::Destination::same_tool
                           ? catalogue::Sides::one_tool
                           : catalogue::Sides::two_tools;
    const auto units = catalogue::units_of(write.parameter, entry->unit, write.unit, sides);
    if (units != catalogue::Units::same) return &write;
  }
  return nullptr;
}

/// How the tool and the profile of the backup differ from those of the restore.
void warn_of_origin(const Snapshot& backup, const Snapshot& present,
                    std::vector<std::string>& warnings) {
  if (!is_same_model(backup, present)) {
    warnings.push_back(fmt::format("the backup is of a {}, and this tool is a {}",
                                   shown_model(backup), shown_model(present)));
  }
  if (backup.identity && present.identity && backup.identity->serial != present.identity->serial) {
    warnings.push_back(fmt::format("the backup is of serial {}, and this tool is serial {}",
                                   backup.identity->serial, present.identity->serial));
  }
  if (shown_firmware(backup) != shown_firmware(present)) {
    warnings.push_back(fmt::format("the backup is of firmware {}, and this tool has {}",
                                   shown_firmware(backup), shown_firmware(present)));
  }
  if (backup.profile != present.profile) {
    warnings.push_back(fmt::format("the backup was made with profile {}, not {}", backup.profile,
                                   present.profile));
  } else if (backup.fingerprint != present.fingerprint) {
    warnings.push_back(
        fmt::format("the backup was made with another version of profile {}", backup.profile));
  }
}

std::string why_skipped(const catalogue::Parameter& parameter, Skip why, const Profile& profile) {
  if (why == Skip::absent) return "this tool has no such register";
  const auto danger = catalogue::danger_of(parameter, profile);
  if (!danger) return "it is not copied to another tool";
  const std::string remedy = danger->remedy();
  return danger->effect() + (remedy.empty() ? "" : "; ") + remedy;
}

/// What the writes themselves bring with them, and what is not written.
void warn_of_plan(const RestoreTask& task, const Profile& profile,
                  std::vector<std::string>& warnings) {
  if (const auto* other = find_other_unit(task); other != nullptr && task.plan.findings.empty()) {
    const auto named = [](const std::string& unit) {
      return unit.empty() ? std::string("a unit that is not known") : unit;
    };
    warnings.push_back(
        fmt::format("{} is in {} in the backup, and in {} on this tool", other->parameter.name,
                    named(task.backup.find(other->parameter.name)->unit), named(other->unit)));
  }
  for (const auto& write : task.plan.writes) {
    if (write.parameter.risk.empty()) continue;
    warnings.push_back(fmt::format("{}: {}", write.parameter.name, write.parameter.risk));
  }
  for (const auto& [parameter, why] : task.plan.skipped) {
    if (why == Skip::read_only || why == Skip::equal) continue;
    warnings.push_back(
        fmt::format("{} is skipped: {}", parameter.name, why_skipped(parameter, why, profile)));
  }
}

/// What somebody should know who is about to restore.
std::vector<std::string> warnings_for(const RestoreTask& task, const Profile& profile) {
  std::vector<std::string> warnings;
  warn_of_origin(task.backup, task.present, warnings);
  warn_of_plan(task, profile, warnings);
  return warnings;
}

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
    listing.add(target.blamed(finding));
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
  auto same = check_model(task.backup, task.present, tool.target, options);
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
  if (!task) return tl::unexpected(task.error());
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
