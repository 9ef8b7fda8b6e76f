#pragma once

#include <compare>
#include <optional>
#include <string>
#include <string_view>

#include "spindle/store/rows.hpp"

namespace spindle::page {

/// Up to where the rows of a store were told: the last event, gap and happening. Each has an order
/// of its own, so one number alone cannot say what comes next.
struct Position {
  store::RowId event = 0;
  store::RowId gap = 0;
  store::RowId happening = 0;

  friend bool operator==(const Position&, const Position&) = default;
};

/// "e12.g3.h45": the id of a server-sent event.
std::string to_text(const Position& position);

/// What to_text() made of one; empty for anything else.
std::optional<Position> parse_position(std::string_view text);

/// Whether all that `a` tells of was told at `b`, too.
bool is_within(const Position& a, const Position& b);

}  // namespace spindle::page
