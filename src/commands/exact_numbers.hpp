#pragma once

#include <optional>

#include "spindle/report/record.hpp"

namespace spindle::commands {

/// The nearest one.
double to_double(const Decimal& value);

/// With nine decimals, but without zeros at their end; empty for what is not finite or too large.
std::optional<Decimal> to_decimal(double value);

/// For records, without zeros at the end: null where there is none.
report::Cell number_or_null(const std::optional<Decimal>& value);
report::Cell number_or_null(const std::optional<double>& value);

}  // namespace spindle::commands
