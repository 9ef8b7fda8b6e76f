#pragma once

#include <string>
#include <string_view>

namespace spindle::chart {

/// The text as content or quoted attribute of HTML and XML. What is no character of a text becomes
/// U+FFFD: ill-formed UTF-8, control characters, those that are unseen or turn the direction of
/// writing, and code points that XML excludes.
std::string escape(std::string_view text);

}  // namespace spindle::chart
