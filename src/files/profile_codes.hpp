#pragma once

#include "files/fields.hpp"
#include "spindle/catalogue/profile.hpp"

namespace spindle::files {

/// A map of codes, or a list of such maps with the evidence that each shares; laid over what is
/// there.
bool read_value(const YamlNode& node, catalogue::CodeTexts& target, const Asked& asked);
template <>
inline constexpr std::string_view value_name<catalogue::CodeTexts> = "texts by code";

/// The keys of one map of such a list.
std::vector<Key> code_list_keys();

}  // namespace spindle::files
