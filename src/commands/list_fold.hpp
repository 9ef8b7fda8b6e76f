#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "spindle/report/record.hpp"

namespace spindle::commands {

/// A list with what is there several times told once.
struct FoldedList {
  std::vector<report::Record> records = {};
  std::vector<std::string> folded = {};  ///< "preset.1-15", each once
};

/// Of `parameter` records whose names differ in one number, from one to the next, and that are else
/// the same to people who read them, three or more become one, in the place of the first:
/// "preset.1-15.speed". Where they were found (`evidence`) may differ and is then told of all.
FoldedList fold(std::vector<report::Record> records);

}  // namespace spindle::commands
