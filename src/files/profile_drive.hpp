#pragma once

#include "files/profile_file.hpp"

namespace spindle::files {

/// What a product says of refused requests, its lists of codes, and what is worth watching. Each
/// lays its keys over the draft.
void read_refusals(const YamlNode& node, ProfileDraft& draft, Diagnostics& findings);
void read_alarm_lists(const YamlNode& node, ProfileDraft& draft, Diagnostics& findings);
void read_alarm_reset(const YamlNode& node, ProfileDraft& draft, Diagnostics& findings);
void read_watched(const YamlNode& node, ProfileDraft& draft, Diagnostics& findings);

/// Their rules, beside those of check_rules().
void check_drive_rules(const ProfileDraft& draft, Diagnostics& findings);

}  // namespace spindle::files
