#include "restore_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "records.hpp"
#include "spindle/base/text.hpp"
#include "spindle/catalogue/snapshot_unit.hpp"
#include "spindle/files/backup_file.hpp"
#include "storing.hpp"

namespace spindle::commands {
namespace {

using catalogue::Parameter;
using catalogue::PlannedWrite;
using catalogue::Skip;
using catalogue::Snapshot;
using catalogue::Value;
using device::RollbackResult;

Error about(const Parameter& parameter, std::string message) {
  return {.code = Errc::mismatch,
          .message = std::move(message),
          .name = parameter.name,
          .register_address = parameter.address.value};
}

/// What can be typed to restore a file, all of it without patterns, as it stands in a message.
std::string command_for(const Target& target, const Context& context, const std::string& file,
                        const std::vector<std::string>& patterns = {}) {
  std::string command =
      fmt::format("spindle restore {} {}", shell_word(target.shown), shell_word(file));
  for (const std::string& pattern : patterns) command += " " + shell_word(pattern);
  const work::CommonOptions& common = context.common;
  if (!common.profile.empty()) command += " --profile " + shell_word(common.profile);
  if (!common.tools_file.empty()) command += " --tools " + shell_word(common.tools_file);
  return shown_command(command);
}

/// What the tool should hold after the restore: what it held before, with the plan laid over it.
Snapshot expected_after(const RestoreTask& task, const std::vector<PlannedWrite>& rest,
                        const catalogue::Profile& profile) {
  Snapshot expected = task.present;
  std::vector<PlannedWrite> writes = task.plan.writes;
  writes.insert(writes.end(), rest.begin(), rest.end());
  const auto entry_of = [&](std::string_view name) {
    return std::find_if(expected.entries.begin(), expected.entries.end(),
                        [&](const auto& entry) { return entry.parameter.name == name; });
  };
  for (const PlannedWrite& write : writes) {
    const auto entry = entry_of(write.parameter.name);
    if (entry == expected.entries.end()) continue;
    entry->raw = catalogue::encode(write.parameter, write.after, entry->raw).value_or(entry->raw);
    entry->parameter = write.parameter;
    entry->value = write.after;
  }
  for (const PlannedWrite& write : writes) {
    for (auto& entry : expected.entries) entry = with_unit_of(std::move(entry), profile, write);
  }
  for (const Parameter& parameter : profile.parameters) {
    if (parameter.scale_by.empty()) continue;
    const auto entry = entry_of(parameter.name);
    if (entry == expected.entries.end()) continue;
    for (const PlannedWrite& write : writes) {
      *entry = catalogue::with_step_of(*entry, parameter, write);
    }
  }
  return expected;
}

std::string said(const Parameter& parameter, const std::optional<Value>& value) {
  return value ? shown_of(parameter, *value) : std::string("nothing");
}

/// What is kept of what the tool holds: a secret only where it is about to be overwritten.
Snapshot kept_of(const RestoreTask& task) {
  Snapshot kept = task.present;
  std::erase_if(kept.entries, [&](const catalogue::SnapshotEntry& entry) {
    const auto& writes = task.plan.writes;
    const bool is_written = std::any_of(writes.begin(), writes.end(), [&](const auto& write) {
      return write.parameter.name == entry.parameter.name;
    });
    if (entry.parameter.secrecy == catalogue::Secrecy::open || is_written) return false;
    kept.missing.push_back({entry.parameter, catalogue::Missing::left_out});
    return true;
  });
  return kept;
}

std::string without_colons(std::string time) {
  std::erase(time, ':');
  return time;
}

}  // namespace

Summary with_change_of(Summary summary, const std::vector<Result<RestoreResult>>& done,
                       const CommonRun& run) {
  const bool is_changed = std::any_of(done.begin(), done.end(),
                                      [](const auto& one) { return one && !one->change.empty(); });
  return is_changed ? with_change(std::move(summary), run.id()) : summary;
}

RestoreRun::RestoreRun(const RestoreOptions& options, const RestoreTask& task, OpenTool& tool,
                       const std::string& run, Context& context)
    : options_(&options),
      task_(&task),
      tool_(&tool),
      context_(&context),
      uninterruptible_line_(tool, context),
      log_(change_log("restore", tool, context, run)),
      changer_(tool.device, log_, tool.target),
      progress_(context),
      counts_(counts_of(task.plan)) {}

Result<RestoreResult> RestoreRun::run() {
  TRY(save_present());
  listing_.emplace(*context_, restore_columns());
  write_all();
  if (errors_.empty()) verify();
  return end();
}

/// Before the first write; without it nothing is written.
Result<void> RestoreRun::save_present() {
  if (task_->plan.writes.empty()) return {};
  if (context_->state_folder.empty()) {
    return tl::unexpected(Error{.code = Errc::bad_file,
                                .message = "the tool's present state cannot be saved: neither "
                                           "XDG_STATE_HOME nor HOME is set, so nothing was written",
                                .hint = "set one of them to a folder"});
  }
  const std::string folder = context_->state_folder + "/backups";
  const std::string path = fmt::format("{}/{}-{}.yaml", folder, file_name_of(task_->present.target),
                                       without_colons(task_->present.time));
  auto saved = context_->disk.make_folders(folder, Privacy::own).and_then([&] {
    return context_->disk.write(path, files::render_backup(kept_of(*task_)), Overwrite::allow,
                                Privacy::own);
  });
  if (!saved) {
    saved.error().hint = "the tool's present state must be saved first, so nothing was written";
    return saved;
  }
  saved_ = path;
  context_->renderer.note(fmt::format("the tool's present state is saved in {}", path));
  return {};
}

/// What is guarded goes first, as it may change what the others mean, or change them along.
void RestoreRun::write_all() {
  for (const PlannedWrite& write : task_->plan.writes) {
    const bool is_guarded = write.parameter.guarding == catalogue::Guarding::alone;
    (is_guarded ? guarded_ : rest_).push_back(write);
  }
  write(guarded_);
  if (errors_.empty() && !guarded_.empty()) plan_rest();
  if (errors_.empty()) write(rest_);
  if (!errors_.empty()) roll_back();
}

void RestoreRun::write(const std::vector<PlannedWrite>& writes) {
  work::write_in_passes(
      writes, [&](const PlannedWrite& one) { return write_one(one); },
      [&](const PlannedWrite& one) { give_up(one); });
}

/// Everything, with the unit of torques, which may be another one by now.
Result<ToolSnapshot> RestoreRun::read_again(std::string_view what) {
  TRY(work::read_torque_unit(*tool_));
  return take_snapshot(*tool_, Secrets::include, *context_,
                       progress_.counter(fmt::format("{}: {}", tool_->target.shown, what)));
}

/// By what the tool holds now.
void RestoreRun::plan_rest() {
  const auto now = read_again("reading again");
  if (!now) return fail(now.error());
  for (const Error& error : now->unreadable) fail(error);
  auto plan = catalogue::plan_restore(task_->backup, now->snapshot, tool_->device.profile(),
                                      task_->selection, task_->destination);
  for (const Error& finding : plan.findings) fail(finding);
  for (const PlannedWrite& write : plan.writes) {
    if (write.parameter.guarding == catalogue::Guarding::none) continue;
    fail(about(write.parameter, fmt::format("holds {} again, not {}: writing another parameter "
                                            "changed it",
                                            shown_of(write.parameter, write.before),
                                            shown_of(write.parameter, write.after))));
  }
  rest_ = std::move(plan.writes);
  counts_.planned = guarded_.size() + rest_.size();
}

work::Step RestoreRun::write_one(const PlannedWrite& write) {
  if (context_->interrupt.signalled()) {
    fail(context_->interrupt.error());
    return work::Step::ended;
  }
  if (is_missing(write.needs)) {
    refused_.insert_or_assign(
        &write, device::Written{device::WriteResult::refused, write.before,
                                about(write.parameter,
                                      fmt::format("{} was not written, which says what its steps "
                                                  "are worth",
                                                  write.needs))});
    return work::Step::refused;
  }
  device::Written written = changer_.make(write.parameter, write.before, write.after);
  if (written.done()) {
    refused_.erase(&write);
    note(write.parameter, write.before, Ending::written, *written.now);
    progress_.advance({.what = tool_->target.shown + ": writing",
                       .done = ++counts_.written,
                       .total = counts_.planned});
    return work::Step::done;
  }
  const bool is_refused = written.result == device::WriteResult::refused;
  refused_.insert_or_assign(&write, std::move(written));
  if (is_refused) return work::Step::refused;
  give_up(write);
  return work::Step::ended;
}

/// Whether what a write needs was to be written, and was not.
bool RestoreRun::is_missing(const std::string& name) const {
  return std::any_of(refused_.begin(), refused_.end(),
                     [&](const auto& refused) { return refused.first->parameter.name == name; });
}

void RestoreRun::give_up(const PlannedWrite& write) {
  const device::Written& written = refused_.at(&write);
  note(write.parameter, write.before, ending_of(written.result), written.now.value_or(write.after));
  fail(*written.error);
}

void RestoreRun::verify() {
  if (!task_->plan.writes.empty()) compare_everything();
  for (const catalogue::SkippedEntry& skipped : task_->plan.skipped) {
    if (skipped.why != Skip::absent) continue;
    fail(about(skipped.parameter,
               "the backup has a value for it, but the tool has no such register"));
  }
}

/// A tool may change one parameter when another one is written, so everything is read once more.
void RestoreRun::compare_everything() {
  const auto now = read_again("verifying");
  if (!now) {
    fail(now.error());
    return roll_back();
  }
  for (const Error& error : now->unreadable) fail(error);
  const auto changed =
      catalogue::compare(expected_after(*task_, rest_, tool_->device.profile()), now->snapshot, {});
  for (const catalogue::Difference& difference : changed.differences) {
    if (changes_by_itself(difference.parameter)) continue;
    Error error = about(difference.parameter,
                        fmt::format("holds {} after the restore, not {}: writing another "
                                    "parameter changed it",
                                    said(difference.parameter, difference.b),
                                    said(difference.parameter, difference.a)));
    error.hint = fmt::format("{} writes what is left; what the tool held before is in {}",
                             command_to_finish(), saved_);
    fail(error);
  }
}

/// Opens the same tool on a line that signals do not end.
device::Rollback::Reopen RestoreRun::reopener() {
  return [this](Duration patience) -> Result<device::Device> {
    progress_.show("the link is lost; trying to put the tool back");
    auto opened = uninterruptible_line_.connect(patience);
    if (!opened) return opened;
    auto known = opened->require_known_registers().and_then([&] { return same_tool(*opened); });
    if (!known) return tl::unexpected(std::move(known.error()));
    return opened;
  };
}

/// Another tool may answer at the same address by now.
Result<void> RestoreRun::same_tool(const device::Device& opened) const {
  const auto& before = task_->present.identity;
  const auto& now = opened.identity();
  if (!before || !now || before->serial == now->serial) return {};
  return tl::unexpected(
      Error{.code = Errc::mismatch,
            .message = fmt::format("another tool answers there now (serial {})", now->serial)});
}

void RestoreRun::roll_back() {
  if (changer_.sent().empty() || options_->on_failure == OnFailure::leave) return;
  progress_.show(fmt::format("{}: putting it back", tool_->target.shown));
  device::Rollback rollback(tool_->device, reopener(), context_->uninterruptible.clock);
  const auto reports = changer_.put_back(rollback);
  const bool complete = std::all_of(reports.begin(), reports.end(), [](const auto& report) {
    return report.result == RollbackResult::done || report.result == RollbackResult::kept;
  });
  if (!complete) outcome_ = {};  // what the tool holds matters more than why it came to that
  for (const device::PutBackReport& report : reports) report_put_back(report);
  if (complete) check_rolled_back(rollback);
}

void RestoreRun::report_put_back(const device::PutBackReport& report) {
  const auto& [parameter, before, tried, doubt] = report.write;
  if (report.result == RollbackResult::kept) return;
  if (report.result == RollbackResult::done) {
    ++counts_.rolled_back;
    note(parameter, report.found.value_or(tried), Ending::rolled_back, before);
    return;
  }
  const std::string holds =
      report.now ? fmt::format("holds {}", shown_of(parameter, *report.now))
                 : fmt::format("holds {} or {}, it is not known which", shown_of(parameter, tried),
                               shown_of(parameter, before));
  Error error = about(parameter, fmt::format("COULD NOT BE PUT BACK to {}: it {}: {}",
                                             shown_of(parameter, before), holds, report.trouble));
  if (report.result == RollbackResult::unknown) error.code = Errc::no_answer;
  error.hint = fmt::format("{} puts everything back, {} finishes the restore",
                           command_for(tool_->target, *context_, saved_), command_to_finish());
  fail(error);
}

/// What was not written may have changed all the same.
void RestoreRun::check_rolled_back(device::Rollback& rollback) {
  std::vector<Parameter> parameters;
  for (const auto& entry : task_->present.entries) parameters.push_back(entry.parameter);
  const auto readings = rollback.read_again(parameters);
  if (!readings) {
    fail(Error{
        .code = Errc::no_answer,
        .message = fmt::format("what was written is put back, but the rest could not be checked: "
                               "{}",
                               message_of(readings.error()))});
    return;
  }
  for (std::size_t index = 0; index < readings->size(); ++index) {
    const auto value = (*readings)[index].held();
    const Value& before = task_->present.entries[index].value;
    if (!value || *value == before || changes_by_itself(parameters[index])) continue;
    Error error = about(
        parameters[index],
        fmt::format("holds {} after everything was put back, but held {} before",
                    shown_of(parameters[index], *value), shown_of(parameters[index], before)));
    error.hint =
        fmt::format("{} puts everything back", command_for(tool_->target, *context_, saved_));
    fail(error);
  }
}

void RestoreRun::note(const Parameter& parameter, const Value& before, Ending ending,
                      const Value& now) {
  listing_->add(change_record(parameter, before, ending, now, tool_->target, context_->clock));
}

void RestoreRun::fail(const Error& error) {
  outcome_.fail(error);
  errors_.push_back(with_target(error, tool_->target));
}

std::string RestoreRun::command_to_finish() const {
  return command_for(tool_->target, *context_, task_->file, options_->patterns);
}

/// What was written and is not put back, because it is wanted so.
void RestoreRun::tell_what_stays() {
  const std::size_t planned = counts_.planned;
  const bool left = !errors_.empty() && counts_.written < planned && counts_.rolled_back == 0;
  if (!left || options_->on_failure != OnFailure::leave) return;
  Error error =
      with_target(Error{.code = errors_.front().code,
                        .message = fmt::format("{} of {} parameters are written and stay so",
                                               counts_.written, planned)},
                  tool_->target);
  error.hint = fmt::format("{} writes the rest", command_to_finish());
  errors_.push_back(error);
}

Result<RestoreResult> RestoreRun::end() {
  tell_what_stays();
  auto told = listing_->end();
  if (told && errors_.empty() && options_->storing == Storing::yes) {
    told = store(*tool_, log_, outcome_, *context_);
  }
  for (const Error& error : errors_) {
    // On stderr it is in any case.
    static_cast<void>(context_->renderer.error(error, context_->clock.wall()));
  }
  if (errors_.empty() && outcome_.failed() == 0) outcome_.succeed();
  if (!told && errors_.empty()) return tl::unexpected(std::move(told.error()));
  const RestoreResult result{outcome_, counts_, log_.run()};
  if (!told) return result;
  Summary summary = with_change(restore_summary(counts_, saved_, tool_->target.shown), log_);
  if (!errors_.empty()) summary.sentence += fmt::format(", {} rolled back", counts_.rolled_back);
  return tell(std::move(summary), outcome_, *context_).map([&] { return result; });
}

}  // namespace spindle::commands
