#pragma once

#include "files/profile_file.hpp"

namespace spindle::files {

/// The section `run`: lays its keys over the draft. A profile of another model than its base has
/// nothing of the base's model.
void read_run(const YamlNode& node, ProfileDraft& draft, Findings& findings);

/// Its rules, beside those of check_rules().
void check_run_rules(const ProfileDraft& draft, Findings& findings);

}  // namespace spindle::files
