#pragma once

#include "files/profile_file.hpp"
#include "files/value_reader.hpp"

namespace spindle::files {

/// Lays the lists `parameters` and `actions` over the draft; a name of an earlier layer is
/// replaced, a name of the same layer is a finding.
void read_parameters(const YamlNode& list, ProfileDraft& draft, const Asked& asked);
void read_actions(const YamlNode& list, ProfileDraft& draft, const Asked& asked);

/// The keys of one entry of them.
std::vector<Key> parameter_keys();
std::vector<Key> action_keys();

}  // namespace spindle::files
