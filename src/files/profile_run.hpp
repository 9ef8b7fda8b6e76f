#pragma once

#include "files/known_keys.hpp"
#include "files/profile_file.hpp"

namespace spindle::files {

/// The section `run`: lays its keys over the draft. A profile of another model than its base has
/// nothing of the base's model.
void read_run(const YamlNode& node, ProfileDraft& draft, const Asked& asked);

/// Its keys, and those that it has beside them of each model.
std::vector<Key> run_keys();
std::vector<KeyList> run_model_keys();

/// Where no layer of a whole profile says how it is run: by the one action that may start a motion
/// and has a stop, so that it can be stopped; by none where there are several.
void derive_run(ProfileDraft& draft);

}  // namespace spindle::files
