#pragma once

#include <string>
#include <string_view>

namespace spindle {

/// Appends a JSON string (RFC 8259). Ill-formed UTF-8 becomes U+FFFD; every control character, C1
/// included, and what is not seen is escaped, so that a line shown on a terminal cannot steer it.
void append_json_string(std::string& out, std::string_view text);

}  // namespace spindle
