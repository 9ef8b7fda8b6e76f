#pragma once

#include <string>
#include <vector>

#include "page/position.hpp"
#include "page/view.hpp"

/// What the page shows, for programs. Pure.
namespace spindle::page {

/// `text` as a JSON string.
std::string quoted(std::string_view text);

/// One tool: an object.
std::string station_json(const Station& station, const LinkView& link);

/// All that /api/state says; `tools` are objects of station_json().
std::string state_json(const Overview& overview, const Position& position, WallTime as_of,
                       const std::vector<std::string>& tools);

}  // namespace spindle::page
