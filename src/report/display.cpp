#include "display.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <utility>

#include "spindle/base/characters.hpp"
#include "spindle/base/utf8.hpp"

namespace spindle::report {
namespace {

/// Whether every byte is a printable character of ASCII, one cell wide. Nearly all that is shown
/// is, so eight bytes are looked at at once: the highest bit of a byte is set in one of these three
/// when it is above 7Fh, below 20h, or 7Fh.
bool is_plain(std::string_view text) {
  constexpr std::uint64_t ones = 0x0101010101010101;
  std::uint64_t found = 0;
  for (; text.size() >= sizeof found; text.remove_prefix(sizeof found)) {
    std::uint64_t bytes = 0;
    std::memcpy(&bytes, text.data(), sizeof bytes);
    found |= bytes | (bytes - ones * ' ') | (bytes + ones);
  }
  if ((found & (ones * 0x80)) != 0) return false;
  return std::all_of(text.begin(), text.end(), [](char c) { return c >= ' ' && c <= '~'; });
}

constexpr std::string_view breaks_and_tabs = "\r\n\t";

/// Appends the first character of `text` in a harmless form; returns how many bytes it took.
std::size_t append_printable(std::string& out, std::string_view text) {
  const CodePoint character = first_code_point(text);
  if (is_unsafe_on_terminal(character.value)) {
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

/// The cell, or what the record says of itself.
std::string_view own_text(const Record& record, std::string_view key, const Field* field,
                          std::string& made) {
  if (field != nullptr) {
    if (const auto* text = std::get_if<std::string>(&field->cell)) return *text;
    return made = to_text(field->cell);
  }
  if (key == "target") return record.target;
  if (key == "time") return made = to_text(record.time);
  if (key == "type") return record.type;
  return {};
}

}  // namespace

std::size_t display_width(std::string_view text) {
  if (is_plain(text)) return text.size();
  std::size_t width = 0;
  while (!text.empty()) {
    const CodePoint character = first_code_point(text);
    width += cell_width(character.value);
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
      width -= cell_width(character.value);
      text.remove_prefix(character.length);
    }
    return std::string(mark).append(text);
  }
  std::size_t kept = 0;
  for (std::size_t taken = 0;;) {
    const CodePoint character = first_code_point(text.substr(kept));
    taken += cell_width(character.value);
    if (taken > room) break;
    kept += character.length;
  }
  return std::string(text.substr(0, kept)).append(mark);
}

std::size_t append_cells(std::string& out, std::string_view text) {
  if (is_plain(text)) {
    out += text;
    return text.size();
  }
  const std::string shown = printable(text, LineBreaks::fold);
  out += shown;
  return display_width(shown);
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

std::string_view shown_text(const Record& record, std::string_view key, const Field* field,
                            std::string& made) {
  if (field != nullptr && !field->shown.empty()) return field->shown;
  return own_text(record, key, field, made);
}

std::string_view cell_text(const Record& record, std::string_view key, std::string& made) {
  return own_text(record, key, record.find(key), made);
}

}  // namespace spindle::report
