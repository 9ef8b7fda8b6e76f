#pragma once

#include <functional>
#include <string_view>

#include "spindle/catalogue/value.hpp"

namespace spindle::catalogue {

/// What a parameter of this name holds.
using ValueOf = std::function<Result<Value>(std::string_view name)>;

/// The parameter as others mean it that were read with it: with the names of bits that count, and
/// the scale. Where its scale cannot be known that is an error (`bad_value`, or that of the
/// reading), and so is a part that does not count at present (`usage`). Names of bits that cannot
/// be known are left out.
Result<Parameter> meant_by_others(const Parameter& parameter, const ValueOf& value_of);

}  // namespace spindle::catalogue
