#pragma once

#include <string>

#include "files/fields.hpp"
#include "spindle/catalogue/snapshot.hpp"

namespace spindle::files {

void read_identity_bytes(const YamlNode& node, catalogue::SnapshotIdentity& identity,
                         const Asked& asked);

/// What a tool said of itself, in files of what it held.
inline constexpr Field<catalogue::SnapshotIdentity> identity_fields[] = {
    field<&catalogue::SnapshotIdentity::model>("model"),
    field_as<std::uint16_t, &catalogue::SnapshotIdentity::model_code>("model-code"),
    field<&catalogue::SnapshotIdentity::serial>("serial"),
    field<&catalogue::SnapshotIdentity::version>("version"),
    field_as<std::uint16_t, &catalogue::SnapshotIdentity::firmware>("firmware"),
    custom("raw", Need::optional, "bytes in hexadecimal digits", read_identity_bytes),
};

/// The line of the same keys.
std::string line_of(const catalogue::SnapshotIdentity& identity);

}  // namespace spindle::files
