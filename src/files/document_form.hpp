#pragma once

#include <string_view>

#include "files/yaml_reader.hpp"

namespace spindle::files {

/// The only format there is of files that the program writes; a later one gets a number of its own.
inline constexpr std::string_view known_format = "1";

/// Whether a document is a "backup", a "dump", by its kind and its format; a finding where it is
/// not.
bool has_form(const YamlNode& document, std::string_view what, Diagnostics& findings);

}  // namespace spindle::files
