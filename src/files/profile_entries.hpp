#pragma once

#include "files/profile_file.hpp"
#include "files/value_reader.hpp"

namespace spindle::files {

/// Lays the lists `parameters` and `actions` over the draft; a name of an earlier layer is
/// replaced, a name of the same layer is a finding.
void read_parameters(const YamlNode& list, ProfileDraft& draft, const Asked& asked);
/// The same of `event-fields`, which are parameters of the event block alone.
void read_event_fields(const YamlNode& list, ProfileDraft& draft, const Asked& asked);
void read_actions(const YamlNode& list, ProfileDraft& draft, const Asked& asked);

template <>
constexpr std::string_view value_name<catalogue::List<catalogue::Label>> = "text by number";
bool read_value(const YamlNode& node, catalogue::List<catalogue::Label>& target,
                const Asked& asked);

/// The keys of one entry of them.
std::vector<Key> parameter_keys();
std::vector<Key> action_keys();

}  // namespace spindle::files
