#include "files/yaml_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <utility>

#include "spindle/base/utf8.hpp"

namespace spindle::files {
namespace {

bool is_plain(std::string_view text) {
  const auto is_letter = [](char c) { return c >= 'a' && c <= 'z'; };
  const auto is_plain_character = [&](char c) {
    return is_letter(c) || (c >= '0' && c <= '9') || c == '.' || c == '-';
  };
  constexpr std::array<std::string_view, 8> other_meaning = {"y",  "n",   "yes",  "no",
                                                             "on", "off", "true", "null"};
  return !text.empty() && is_letter(text.front()) && text != "false" &&
         std::all_of(text.begin(), text.end(), is_plain_character) &&
         std::find(other_meaning.begin(), other_meaning.end(), text) == other_meaning.end();
}

/// Characters that a reader of YAML would fold or refuse, or that no reader would see: controls,
/// marks of width and direction, separators of lines, and those that are none.
constexpr std::array<std::pair<char32_t, char32_t>, 7> escaped_ranges = {{{0x00, 0x1F},
                                                                          {0x7F, 0x9F},
                                                                          {0x200B, 0x200F},
                                                                          {0x2028, 0x202E},
                                                                          {0x2060, 0x206F},
                                                                          {0xFEFF, 0xFEFF},
                                                                          {0xFFF9, 0xFFFF}}};

bool is_escaped(char32_t value) {
  return std::any_of(escaped_ranges.begin(), escaped_ranges.end(), [value](const auto& range) {
    return value >= range.first && value <= range.second;
  });
}

void append_escaped(std::string& out, char32_t value) {
  constexpr char32_t last_of_two_digits = 0xFF;
  const auto number = static_cast<std::uint32_t>(value);
  if (value <= last_of_two_digits) {
    fmt::format_to(std::back_inserter(out), "\\x{:02x}", number);
  } else {
    fmt::format_to(std::back_inserter(out), "\\u{:04x}", number);
  }
}

}  // namespace

std::string quoted(std::string_view text) {
  std::string out = "\"";
  while (!text.empty()) {
    const CodePoint character = first_code_point(text);
    if (is_escaped(character.value) || !character.well_formed) {
      append_escaped(out, character.value);
    } else {
      if (text.front() == '"' || text.front() == '\\') out += '\\';
      out += text.substr(0, character.length);
    }
    text.remove_prefix(character.length);
  }
  return out + '"';
}

std::string scalar(std::string_view text) {
  return is_plain(text) ? std::string(text) : quoted(text);
}

}  // namespace spindle::files
