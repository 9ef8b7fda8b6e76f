#pragma once

#include <array>
#include <optional>
#include <string_view>
#include <utility>

#include "files/profile_file.hpp"
#include "files/yaml_map.hpp"

namespace spindle::files {

inline constexpr std::array<std::pair<std::string_view, modbus::RegisterTable>, 2> table_words = {
    {{"holding", modbus::RegisterTable::holding}, {"input", modbus::RegisterTable::input}}};

inline constexpr std::array<std::pair<std::string_view, catalogue::Access>, 2> access_words = {
    {{"r", catalogue::Access::read_only}, {"rw", catalogue::Access::read_write}}};

inline constexpr std::array<std::pair<std::string_view, catalogue::Evidence>, 4> evidence_words = {
    {{"manual", catalogue::Evidence::manual},
     {"transcribed", catalogue::Evidence::transcribed},
     {"sibling", catalogue::Evidence::sibling},
     {"inferred", catalogue::Evidence::inferred}}};

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
void read_parameters(const YamlNode& list, ProfileDraft& draft, Findings& findings);
void read_actions(const YamlNode& list, ProfileDraft& draft, Findings& findings);

}  // namespace spindle::files
