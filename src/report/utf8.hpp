#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "spindle/base/utf8.hpp"

namespace spindle::report {

/// Appends the first character of `text`, which is `first`, or U+FFFD for what is none.
void append_first(std::string& out, const CodePoint& first, std::string_view text);

/// The length of the run of printable ASCII characters at the beginning of the text that need no
/// escape in JSON: neither `"` nor `\`.
std::size_t plain_prefix(std::string_view text);

}  // namespace spindle::report
