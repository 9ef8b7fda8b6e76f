#include "spindle/catalogue/snapshot_unit.hpp"

#include <fmt/format.h>

#include <utility>

namespace spindle::catalogue {
namespace {

std::string torque_in_words(const SnapshotEntry& entry) {
  return entry.unit.empty() ? entry.value.to_string() + " in a unit that is not known"
                            : entry.value.to_string() + " " + entry.unit;
}

}  // namespace

SnapshotEntry with_unit_of(SnapshotEntry entry, const Profile& profile, const PlannedWrite& write) {
  const bool is_meant = write.parameter.name == profile.torque_unit_from.view();
  if (is_meant && entry.parameter.unit == torque_unit) entry.unit = write.after.label;
  return entry;
}

Result<void> check_own_unit(const Snapshot& backup, const Profile& profile,
                            const Selection& selection) {
  const Text& decider = profile.torque_unit_from;
  const SnapshotEntry* unit = decider.empty() ? nullptr : backup.find(decider.view());
  if (unit == nullptr) return {};
  for (const SnapshotEntry& entry : backup.entries) {
    const bool is_meant =
        selection.contains(entry.parameter) || selection.contains(unit->parameter);
    if (!is_meant || entry.parameter.unit != torque_unit || entry.unit == unit->value.label) {
      continue;
    }
    return tl::unexpected(Error{
        .code = Errc::mismatch,
        .message = fmt::format("the backup has {}, and its own {} says {}, so it is not known "
                               "which of them is right",
                               torque_in_words(entry), decider, unit->value.to_string()),
        .hint = "was one of them edited? make the backup again",
        .name = entry.parameter.name,
        .register_address = entry.parameter.address.value});
  }
  return {};
}

}  // namespace spindle::catalogue
