#include "spindle/chart/escape.hpp"

#include "spindle/base/characters.hpp"
#include "spindle/base/utf8.hpp"

namespace spindle::chart {
namespace {

/// What stands for a character that has a meaning in markup; empty for others.
std::string_view entity(char32_t character) {
  switch (character) {
    case U'&':
      return "&amp;";
    case U'<':
      return "&lt;";
    case U'>':
      return "&gt;";
    case U'"':
      return "&quot;";
    case U'\'':
      return "&#39;";
    default:
      return {};
  }
}

/// The last two code points of each plane.
bool is_noncharacter(char32_t character) {
  return (character & 0xFFFEU) == 0xFFFEU || (character >= 0xFDD0 && character <= 0xFDEF);
}

}  // namespace

std::string escape(std::string_view text) {
  std::string out;
  out.reserve(text.size());
  while (!text.empty()) {
    const CodePoint first = first_code_point(text);
    const std::string_view replaced = entity(first.value);
    if (!replaced.empty()) {
      out += replaced;
    } else if (is_unsafe_on_terminal(first.value) || is_noncharacter(first.value)) {
      out += "\uFFFD";
    } else {
      append_first(out, first, text);
    }
    text.remove_prefix(first.length);
  }
  return out;
}

}  // namespace spindle::chart
