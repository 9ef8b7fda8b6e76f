#include "spindle/base/utf8.hpp"

#include <algorithm>
#include <array>
#include <cstdint>

namespace spindle {
namespace {

constexpr char32_t replacement_character = U'\uFFFD';

// The Unicode Standard 15.0, table 3-7: well-formed UTF-8 byte sequences.
struct Lead {
  std::uint8_t first;
  std::uint8_t last;
  std::uint8_t second_low;
  std::uint8_t second_high;
  std::size_t length;
  std::uint8_t payload;
};

constexpr std::array leads = {
    Lead{0x00, 0x7F, 0x00, 0x00, 1, 0x7F}, Lead{0xC2, 0xDF, 0x80, 0xBF, 2, 0x1F},
    Lead{0xE0, 0xE0, 0xA0, 0xBF, 3, 0x0F}, Lead{0xE1, 0xEC, 0x80, 0xBF, 3, 0x0F},
    Lead{0xED, 0xED, 0x80, 0x9F, 3, 0x0F}, Lead{0xEE, 0xEF, 0x80, 0xBF, 3, 0x0F},
    Lead{0xF0, 0xF0, 0x90, 0xBF, 4, 0x07}, Lead{0xF1, 0xF3, 0x80, 0xBF, 4, 0x07},
    Lead{0xF4, 0xF4, 0x80, 0x8F, 4, 0x07},
};

}  // namespace

CodePoint first_code_point(std::string_view text) {
  const auto byte_at = [text](std::size_t index) { return static_cast<std::uint8_t>(text[index]); };
  const std::uint8_t lead = byte_at(0);
  const auto* const row = std::find_if(leads.begin(), leads.end(), [lead](const Lead& candidate) {
    return candidate.first <= lead && lead <= candidate.last;
  });
  if (row == leads.end())
    return {.value = replacement_character, .length = 1, .well_formed = false};

  char32_t value = lead & row->payload;
  std::uint8_t low = row->second_low;
  std::uint8_t high = row->second_high;
  for (std::size_t index = 1; index < row->length; ++index) {
    if (index >= text.size() || byte_at(index) < low || byte_at(index) > high) {
      return {.value = replacement_character, .length = index, .well_formed = false};
    }
    value = (value << 6U) | (byte_at(index) & 0x3FU);
    low = 0x80;
    high = 0xBF;
  }
  return {.value = value, .length = row->length};
}

void append_first(std::string& out, const CodePoint& first, std::string_view text) {
  constexpr std::string_view replacement_bytes = "\xEF\xBF\xBD";
  out += first.well_formed ? text.substr(0, first.length) : replacement_bytes;
}

std::size_t plain_prefix(std::string_view text) {
  const auto is_plain = [](char c) { return c >= ' ' && c <= '~' && c != '"' && c != '\\'; };
  const auto* const end = std::find_if_not(text.begin(), text.end(), is_plain);
  return static_cast<std::size_t>(end - text.begin());
}

bool is_utf8(std::string_view text) {
  while (!text.empty()) {
    const CodePoint character = first_code_point(text);
    if (!character.well_formed) return false;
    text.remove_prefix(character.length);
  }
  return true;
}

}  // namespace spindle
