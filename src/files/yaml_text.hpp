#pragma once

#include <string>
#include <string_view>

namespace spindle::files {

/// In quotes, so that every reader of YAML takes it for the same text. What is no character at all
/// has no place in YAML, and is replaced.
std::string quoted(std::string_view text);

/// The text as it is where every reader of YAML takes it for the same text, else in quotes.
std::string scalar(std::string_view text);

}  // namespace spindle::files
