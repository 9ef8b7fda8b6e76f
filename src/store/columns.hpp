#pragma once

#include <string>

#include "spindle/store/rows.hpp"

namespace spindle::store {

/// The names of all values that have columns of their own, in the order of their enumeration and
/// with commas between.
template <typename Words>
std::string names_of(const Words& words) {
  std::string names;
  for (const auto& row : words) {
    if (!names.empty()) names += ", ";
    names += row.word;
  }
  return names;
}

}  // namespace spindle::store
