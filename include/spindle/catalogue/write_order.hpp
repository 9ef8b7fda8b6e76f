#pragma once

#include <cstddef>
#include <vector>

#include "spindle/catalogue/parameter.hpp"

namespace spindle::catalogue {

/// In which order these are written: as they stand, but each behind those that its `after` names,
/// and in front of those that its `before` names. Names that are none of them mean nothing. Of
/// parameters that wait for each other the first comes first. Pure.
std::vector<std::size_t> write_order(const std::vector<Parameter>& parameters);

/// The names of parameters that wait for each other; empty: there are none.
std::vector<std::string> waiting_in_a_circle(const std::vector<Parameter>& parameters);

}  // namespace spindle::catalogue
