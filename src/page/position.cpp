#include "page/position.hpp"

#include <fmt/format.h>

#include <limits>

#include "spindle/base/text.hpp"

namespace spindle::page {
namespace {

std::optional<store::RowId> part(std::string_view text, char letter) {
  if (text.empty() || text.front() != letter) return std::nullopt;
  const auto number = parse_unsigned(text.substr(1), std::numeric_limits<store::RowId>::max());
  if (!number) return std::nullopt;
  return static_cast<store::RowId>(*number);
}

}  // namespace

std::string to_text(const Position& position) {
  return fmt::format("e{}.g{}.h{}", position.event, position.gap, position.happening);
}

std::optional<Position> parse_position(std::string_view text) {
  const auto parts = split(text, '.');
  if (parts.size() != 3) return std::nullopt;
  const auto event = part(parts[0], 'e');
  const auto gap = part(parts[1], 'g');
  const auto happening = part(parts[2], 'h');
  if (!event || !gap || !happening) return std::nullopt;
  return Position{.event = *event, .gap = *gap, .happening = *happening};
}

bool is_within(const Position& a, const Position& b) {
  return a.event <= b.event && a.gap <= b.gap && a.happening <= b.happening;
}

}  // namespace spindle::page
