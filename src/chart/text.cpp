#include "text.hpp"

#include <fmt/format.h>

#include "spindle/base/characters.hpp"
#include "spindle/base/utf8.hpp"

namespace spindle::chart {
namespace {

constexpr std::string_view narrow_space = "\u202F";
constexpr std::string_view ellipsis = "\u2026";
/// The part of the letter height that a character is wide in DejaVu Sans, which is wider than most.
double width_of(char32_t character) {
  constexpr std::u32string_view thin = U" ,.:;|!'()[]/ijlftI\u202F\u2026";
  constexpr std::u32string_view broad = U"mwMW%@\u2192";
  if (cell_width(character) != 1) return static_cast<double>(cell_width(character)) / 2;
  if (thin.find(character) != std::u32string_view::npos) return 0.36;
  if (broad.find(character) != std::u32string_view::npos) return 0.93;
  return character >= U'A' && character <= U'Z' ? 0.69 : 0.62;
}

}  // namespace

double text_width(std::string_view text, double size) {
  double width = 0;
  while (!text.empty()) {
    const CodePoint first = first_code_point(text);
    width += width_of(first.value);
    text.remove_prefix(first.length);
  }
  return width * size;
}

std::string shortened(std::string_view text, double width, double size) {
  // Characters without a width make no text that is shown without an end.
  constexpr std::size_t most = 4000;
  const double room = width - width_of(U'\u2026') * size;
  double used = 0;
  std::size_t end = 0;
  std::size_t kept = 0;  // what fits with an ellipsis behind it
  while (end < text.size()) {
    const CodePoint next = first_code_point(text.substr(end));
    used += width_of(next.value) * size;
    if (used > width || end > most) return std::string(text.substr(0, kept)).append(ellipsis);
    end += next.length;
    if (used <= room) kept = end;
  }
  return std::string(text);
}

std::string grouped(std::uint64_t number) {
  std::string digits = fmt::format("{}", number);
  if (digits.size() < 5) return digits;
  for (std::size_t at = digits.size() - 3; at < digits.size() && at > 0; at -= at > 3 ? 3 : at) {
    digits.insert(at, narrow_space);
  }
  return digits;
}

std::string with_unit(std::string_view name, std::string_view unit) {
  if (unit.empty()) return std::string(name);
  if (name.empty()) return std::string(unit);
  return fmt::format("{}, {}", name, unit);
}

}  // namespace spindle::chart
