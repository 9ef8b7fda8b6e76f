#include "restore_warnings.hpp"

#include <fmt/format.h>

#include <tuple>

#include "spindle/base/text.hpp"
#include "spindle/catalogue/danger.hpp"

namespace spindle::commands {
namespace {

using catalogue::Profile;
using catalogue::Skip;
using catalogue::Snapshot;

std::string shown_model(const Snapshot& snapshot) {
  if (!snapshot.identity) return fmt::format("profile {}", snapshot.profile);
  const auto& [model, code, serial, firmware, raw, version] = *snapshot.identity;
  return model.empty() ? fmt::format("code {}", code.value_or(0)) : model;
}

/// The same model by its own code; where a product does not say it, by its profile.
bool is_same_model(const Snapshot& backup, const Snapshot& present) {
  if (!backup.identity || !present.identity) return backup.profile == present.profile;
  return backup.identity->model_code == present.identity->model_code;
}

/// By the names that the tools have for themselves, where both are known.
bool is_named_alike(const Snapshot& backup, const Snapshot& present) {
  if (!backup.identity || !present.identity) return true;
  const auto& [a, b] = std::tie(backup.identity->model, present.identity->model);
  return a.empty() || b.empty() || a == b;
}

/// "4" of 4.0.2.
std::string_view major_of(std::string_view version) { return version.substr(0, version.find('.')); }

/// Where a write may change what other values mean, values are not brought over to a firmware that
/// may have others.
bool is_same_firmware(const Snapshot& backup, const Snapshot& present) {
  if (!backup.identity || !present.identity) return false;
  const auto& [a, b] = std::tie(*backup.identity, *present.identity);
  if (a.version.empty() || b.version.empty()) return a.firmware && a.firmware == b.firmware;
  return major_of(a.version) == major_of(b.version);
}

std::string shown_firmware(const Snapshot& snapshot) {
  const bool known = snapshot.identity && snapshot.identity->firmware;
  if (known && !snapshot.identity->version.empty()) return snapshot.identity->version;
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
    warnings.push_back(fmt::format("the backup is of {}, and this tool is {}",
                                   with_article(shown_model(backup)),
                                   with_article(shown_model(present))));
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
  if (why == Skip::no_value) return "the backup says that it had no value";
  const auto danger = catalogue::danger_of(parameter, profile);
  if (!danger) return "it is not copied to another tool";
  const std::string remedy = danger->remedy();
  return danger->effect() + (remedy.empty() ? "" : "; ") + remedy;
}

/// What is counted in steps that a write makes worth something else, and is not restored with it.
std::vector<std::string> left_behind(const catalogue::PlannedWrite& write, const RestoreTask& task,
                                     const Profile& profile) {
  std::vector<std::string> names;
  for (const catalogue::Parameter& parameter : profile.parameters) {
    const bool is_setting = parameter.access == catalogue::Access::read_write;
    if (!is_setting || write.parameter.name != parameter.scale_by.view()) continue;
    const auto* entry = task.backup.find(parameter.name);
    const bool is_restored = entry != nullptr && task.selection.contains(parameter);
    if (!is_restored) names.push_back(parameter.name);
  }
  return names;
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
    for (const std::string& name : left_behind(write, task, profile)) {
      warnings.push_back(
          fmt::format("{} will be another quantity, as {} says what its steps are "
                      "worth",
                      name, write.parameter.name));
    }
    if (write.parameter.risk.empty()) continue;
    warnings.push_back(fmt::format("{}: {}", write.parameter.name, write.parameter.risk));
  }
  for (const auto& [parameter, why] : task.plan.skipped) {
    if (why == Skip::read_only || why == Skip::equal) continue;
    warnings.push_back(
        fmt::format("{} is skipped: {}", parameter.name, why_skipped(parameter, why, profile)));
  }
}

}  // namespace

Result<void> check_model(const RestoreTask& task, const Profile& profile) {
  const bool is_guarded = profile.has_guarded();
  const bool is_same = is_same_model(task.backup, task.present) &&
                       (!is_guarded || is_named_alike(task.backup, task.present));
  if (!is_same) {
    return tl::unexpected(
        Error{.code = Errc::wrong_model,
              .message = fmt::format("the backup is of a {}, and this tool is a {}",
                                     shown_model(task.backup), shown_model(task.present)),
              .hint = is_guarded ? "" : "--force restores it all the same",
              .name = task.file});
  }
  if (!is_guarded || is_same_firmware(task.backup, task.present)) return {};
  return tl::unexpected(
      Error{.code = Errc::wrong_model,
            .message = fmt::format("the backup is of firmware {}, and this tool has {}",
                                   shown_firmware(task.backup), shown_firmware(task.present)),
            .hint = "values of one generation of firmware are not restored to another one",
            .name = task.file});
}

std::vector<std::string> warnings_for(const RestoreTask& task, const Profile& profile) {
  std::vector<std::string> warnings;
  warn_of_origin(task.backup, task.present, warnings);
  warn_of_plan(task, profile, warnings);
  return warnings;
}

}  // namespace spindle::commands
