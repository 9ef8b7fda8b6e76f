#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace spindle {

/// "%20", as a byte stands in a URL (RFC 3986, section 2.1).
std::string percent_encoded(char byte);

/// The text with the bytes that such codes stand for; empty where a '%' is not followed by two
/// hexadecimal digits.
std::optional<std::string> percent_decoded(std::string_view text);

}  // namespace spindle
