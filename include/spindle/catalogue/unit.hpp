#pragma once

#include <string>
#include <string_view>

#include "spindle/base/error.hpp"

namespace spindle::catalogue {

/// A number that was typed with a unit behind it, in the unit that a parameter counts in.
struct Converted {
  std::string text;       ///< what to read instead of what was typed
  std::string note = {};  ///< "1.5 kW is 1500 W"; empty: nothing was converted
};

/// A number with a unit behind it ("1.5kW", "5 N.m") as a number of `unit`, the unit in which a
/// parameter is shown. Exact where the factor is a decimal, else with as many digits as fit. What
/// is no number with a unit behind it stays as it is. Error `bad_value` where the unit is of
/// another quantity, or neither known nor the same text: case decides, "mW" is no "MW". An empty
/// `unit` has no others.
Result<Converted> convert_typed(std::string_view text, std::string_view unit);

/// Whether this is a unit of torque that is known.
bool is_torque(std::string_view unit);

}  // namespace spindle::catalogue
