#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace spindle {

/// A code point and the number of bytes that it took.
struct CodePoint {
  char32_t value;
  std::size_t length;
  bool well_formed = true;
};

/// The first code point of a text that is not empty. An ill-formed sequence yields U+FFFD once for
/// its longest valid beginning, or for one byte (The Unicode Standard 15.0, section 3.9, "U+FFFD
/// Substitution of Maximal Subparts").
CodePoint first_code_point(std::string_view text);

/// Whether all of a text is well-formed.
bool is_utf8(std::string_view text);

/// Appends the first character of `text`, which is `first`, or U+FFFD for what is none.
void append_first(std::string& out, const CodePoint& first, std::string_view text);

/// The length of the run of printable ASCII characters at the beginning of the text that need no
/// escape in JSON: neither `"` nor `\`.
std::size_t plain_prefix(std::string_view text);

}  // namespace spindle
