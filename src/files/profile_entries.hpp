#pragma once

#include <optional>

#include "files/profile_file.hpp"
#include "files/yaml_map.hpp"

namespace spindle::files {

/// A section that is laid over what earlier layers of the profile say of it; what it must say is
/// needed only of the first of them.
template <typename Facts>
struct Section {
  Facts& facts;
  Need need;
};

template <typename Facts>
Section<Facts> section_of(std::optional<Facts>& facts) {
  const Need need = facts ? Need::optional : Need::required;
  if (!facts) facts.emplace();
  return {*facts, need};
}

/// Lays the lists `parameters` and `actions` over the draft; a name of an earlier layer is
/// replaced, a name of the same layer is a finding.
void read_parameters(const YamlNode& list, ProfileDraft& draft, Diagnostics& findings);
void read_actions(const YamlNode& list, ProfileDraft& draft, Diagnostics& findings);

}  // namespace spindle::files
