#pragma once

#include "spindle/catalogue/snapshot.hpp"

namespace spindle::catalogue {

/// The entry with its unit once `write` is done, where that says the unit of torques; as it is
/// otherwise.
SnapshotEntry with_unit_of(SnapshotEntry entry, const Profile& profile, const PlannedWrite& write);

/// Whether the torques of a backup that are meant have the unit that the backup itself says. Error
/// `mismatch`.
Result<void> check_own_unit(const Snapshot& backup, const Profile& profile,
                            const Selection& selection);

}  // namespace spindle::catalogue
