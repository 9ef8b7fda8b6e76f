#include "display.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "characters.hpp"
#include "utf8.hpp"

namespace spindle::report {
namespace {

constexpr std::string_view breaks_and_tabs = "\r\n\t";

/// Appends the first character of `text` in a harmless form; returns how many bytes it took.
std::size_t append_printable(std::string& out, std::string_view text) {
  const CodePoint character = first_code_point(text);
  if (steers(character.value)) {
    const auto value = static_cast<std::uint32_t>(character.value);
    const bool is_byte = value <= 0xFF;
    const bool is_short = value <= 0xFFFF;
    if (is_byte) fmt::format_to(std::back_inserter(out), "\\x{:02x}", value);
    if (!is_byte && is_short) fmt::format_to(std::back_inserter(out), "\\u{:04x}", value);
    if (!is_short) fmt::format_to(std::back_inserter(out), "\\U{:08x}", value);
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
    width += cells_of(character.value);
    text.remove_prefix(character.length);
  }
  return width;
}

std::string fitted(std::string_view text, std::size_t cells, Keep keep) {
  constexpr std::string_view dots = "...";
  std::size_t width = display_width(text);
  if (width <= cells) return std::string(text);
  const std::string_view mark = dots.substr(0, cells);
  const std::size_t room = cells - mark.size();
  if (keep == Keep::end) {
    while (width > room) {
      const CodePoint character = first_code_point(text);
      width -= cells_of(character.value);
      text.remove_prefix(character.length);
    }
    return std::string(mark).append(text);
  }
  std::size_t kept = 0;
  for (std::size_t taken = 0;;) {
    const CodePoint character = first_code_point(text.substr(kept));
    taken += cells_of(character.value);
    if (taken > room) break;
    kept += character.length;
  }
  return std::string(text.substr(0, kept)).append(mark);
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
