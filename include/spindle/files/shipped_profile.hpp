#pragma once

#include <span>
#include <string_view>

#include "spindle/catalogue/profile.hpp"

namespace spindle::files {

/// A profile that is part of the program: what its YAML file says, as constant data. Bases whose
/// file says `abstract: true` are among them.
struct ShippedProfile {
  std::string_view id;
  std::string_view yaml;     ///< the whole file that it was made from
  std::string_view extends;  ///< id of its base; empty: none
  bool is_abstract = false;
  const catalogue::Profile* profile;
  const catalogue::SimulationSpec* simulation;  ///< its own, or that of the nearest base
  const catalogue::CodeTables* codes;           ///< with those of its bases
};

/// By ascending id.
using ShippedProfiles = std::span<const ShippedProfile>;

/// Null when there is none.
const ShippedProfile* find(ShippedProfiles shipped, std::string_view id);

}  // namespace spindle::files
