#pragma once

#include "files/profile_file.hpp"

namespace spindle::files {

/// Whether a text is a name as profiles use them: lower-case words and numbers joined by single
/// dots or hyphens ("preset.1.target-torque").
bool is_catalogue_name(std::string_view text);

/// Every rule that a profile must keep, beyond the shape of its files. Runs on every load; adds a
/// finding for each breach. What could not be read is to be left out before.
void check_rules(const ProfileDraft& draft, Diagnostics& findings);

/// Those of what a product says of refused requests and of its codes, of bit fields, and of the
/// section `run`: part of check_rules().
void check_drive_rules(const ProfileDraft& draft, Diagnostics& findings);
void check_run_rules(const ProfileDraft& draft, Diagnostics& findings);
/// Those of how tools are found, of what is searched for on them, and of what they can show.
void check_finding_rules(const ProfileDraft& draft, Diagnostics& findings);

/// What may move a tool and is guarded by nothing but a refusal: no reason not to load a profile,
/// so only a check pays for it.
void check_guards(const ProfileDraft& draft, Diagnostics& findings);

}  // namespace spindle::files
