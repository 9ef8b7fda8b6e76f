#include "spindle/base/json.hpp"

#include <fmt/format.h>

#include <iterator>

#include "spindle/base/characters.hpp"
#include "spindle/base/utf8.hpp"

namespace spindle {
namespace {

/// Escaped in UTF-16, as RFC 8259, section 7 wants it.
void append_escaped(std::string& out, char32_t value) {
  constexpr char32_t first_of_two_units = 0x10000;
  if (value < first_of_two_units) {
    fmt::format_to(std::back_inserter(out), "\\u{:04x}", static_cast<std::uint32_t>(value));
    return;
  }
  const auto beyond = static_cast<std::uint32_t>(value - first_of_two_units);
  fmt::format_to(std::back_inserter(out), "\\u{:04x}\\u{:04x}", 0xD800U | (beyond >> 10U),
                 0xDC00U | (beyond & 0x3FFU));
}

std::string_view short_escape(char32_t value) {
  switch (value) {
    case U'"':
      return "\\\"";
    case U'\\':
      return "\\\\";
    case U'\b':
      return "\\b";
    case U'\f':
      return "\\f";
    case U'\n':
      return "\\n";
    case U'\r':
      return "\\r";
    case U'\t':
      return "\\t";
    default:
      return {};
  }
}

/// Appends the first character of `text` and returns how many bytes it took.
std::size_t append_character(std::string& out, std::string_view text) {
  const CodePoint character = first_code_point(text);
  if (const std::string_view escape = short_escape(character.value); !escape.empty()) {
    out += escape;
  } else if (is_unsafe_on_terminal(character.value)) {
    append_escaped(out, character.value);
  } else {
    append_first(out, character, text);
  }
  return character.length;
}

}  // namespace

void append_json_string(std::string& out, std::string_view text) {
  out += '"';
  while (!text.empty()) {
    const std::size_t plain = plain_prefix(text);
    out += text.substr(0, plain);
    text.remove_prefix(plain);
    if (!text.empty()) text.remove_prefix(append_character(out, text));
  }
  out += '"';
}

}  // namespace spindle
