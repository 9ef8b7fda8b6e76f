#include "display.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <span>

#include "utf8.hpp"

namespace spindle::report {
namespace {

struct Span {
  char32_t first;
  char32_t last;
};

// Unicode 15.0: the general categories Mn, Me and Cf of the scripts that turn up in plants, joiners
// and variation selectors.
constexpr std::array zero_width = {
    Span{0x0300, 0x036F}, Span{0x0483, 0x0489}, Span{0x0591, 0x05BD}, Span{0x0610, 0x061A},
    Span{0x064B, 0x065F}, Span{0x0E31, 0x0E31}, Span{0x0E34, 0x0E3A}, Span{0x0E47, 0x0E4E},
    Span{0x1AB0, 0x1AFF}, Span{0x1DC0, 0x1DFF}, Span{0x200B, 0x200F}, Span{0x202A, 0x202E},
    Span{0x2060, 0x2064}, Span{0x20D0, 0x20FF}, Span{0x302A, 0x302D}, Span{0x3099, 0x309A},
    Span{0xFE00, 0xFE0F}, Span{0xFE20, 0xFE2F}, Span{0xFEFF, 0xFEFF}, Span{0xE0100, 0xE01EF},
};

// Unicode Standard Annex 11: the blocks whose characters are W or F.
constexpr std::array double_width = {
    Span{0x1100, 0x115F},   Span{0x2E80, 0x303E},   Span{0x3041, 0x33FF},   Span{0x3400, 0x4DBF},
    Span{0x4E00, 0x9FFF},   Span{0xA000, 0xA4CF},   Span{0xA960, 0xA97C},   Span{0xAC00, 0xD7A3},
    Span{0xF900, 0xFAFF},   Span{0xFE30, 0xFE6F},   Span{0xFF01, 0xFF60},   Span{0xFFE0, 0xFFE6},
    Span{0x1F300, 0x1F64F}, Span{0x1F680, 0x1F6FF}, Span{0x1F900, 0x1F9FF}, Span{0x20000, 0x3FFFD},
};

bool is_in(char32_t value, std::span<const Span> spans) {
  return std::any_of(spans.begin(), spans.end(), [value](const Span& span) {
    return span.first <= value && value <= span.last;
  });
}

std::size_t width_of(char32_t value) {
  if (value < zero_width.front().first) return 1;
  if (is_in(value, zero_width)) return 0;
  return is_in(value, double_width) ? 2 : 1;
}

constexpr std::string_view breaks_and_tabs = "\r\n\t";

bool is_control(char32_t value) { return value < 0x20 || (value >= 0x7F && value < 0xA0); }

/// Appends the first character of `text` in a harmless form; returns how many bytes it took.
std::size_t append_printable(std::string& out, std::string_view text) {
  const CodePoint character = first_code_point(text);
  if (is_control(character.value)) {
    fmt::format_to(std::back_inserter(out), "\\x{:02x}",
                   static_cast<std::uint32_t>(character.value));
  } else {
    append_first(out, character, text);
  }
  return character.length;
}

}  // namespace

std::size_t display_width(std::string_view text) {
  std::size_t width = 0;
  while (!text.empty()) {
    const CodePoint character = first_code_point(text);
    width += width_of(character.value);
    text.remove_prefix(character.length);
  }
  return width;
}

std::string printable(std::string_view text, LineBreaks breaks) {
  std::string out;
  out.reserve(text.size());
  while (!text.empty()) {
    const std::size_t run = std::min(text.find_first_not_of(breaks_and_tabs), text.size());
    if (run == 0) {
      text.remove_prefix(append_printable(out, text));
      continue;
    }
    out += breaks == LineBreaks::keep ? text.substr(0, run) : std::string_view(" ");
    text.remove_prefix(run);
  }
  return out;
}

std::string shown_text(const Record& record, std::string_view key) {
  const Field* const field = record.find(key);
  const bool has_own = field != nullptr && !field->shown.empty();
  return has_own ? field->shown : cell_text(record, key);
}

std::string cell_text(const Record& record, std::string_view key) {
  if (key == "target") return record.target;
  if (key == "time") return to_text(record.time);
  if (key == "type") return record.type;
  const Field* const field = record.find(key);
  return field == nullptr ? std::string() : to_text(field->cell);
}

}  // namespace spindle::report
