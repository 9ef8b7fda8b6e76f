#include "spindle/base/characters.hpp"

#include <algorithm>
#include <span>

#include "character_table.hpp"

namespace spindle {
namespace {

bool is_in(char32_t character, std::span<const CodePoints> spans) {
  const auto behind =
      std::upper_bound(spans.begin(), spans.end(), character,
                       [](char32_t value, const CodePoints& span) { return value < span.first; });
  return behind != spans.begin() && character <= std::prev(behind)->last;
}

bool is_control(char32_t character) {
  return character < 0x20 || (character >= 0x7F && character < 0xA0);
}

}  // namespace

std::size_t cell_width(char32_t character) {
  if (character < zero_width.front().first) return 1;
  if (is_in(character, zero_width)) return 0;
  return is_in(character, two_cells) ? 2 : 1;
}

bool is_unsafe_on_terminal(char32_t character) {
  return is_control(character) || is_in(character, unseen);
}

}  // namespace spindle
