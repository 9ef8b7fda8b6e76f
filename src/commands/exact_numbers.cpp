#include "exact_numbers.hpp"

#include <fmt/format.h>

#include <cmath>

#include "spindle/work/study.hpp"

namespace spindle::commands {

double to_double(const Decimal& value) {
  const auto mantissa = static_cast<double>(value.mantissa());
  // Powers of ten up to 22 are exact, so that a quotient is the nearest number.
  return value.exponent() < 0 ? mantissa / std::pow(10.0, -value.exponent())
                              : mantissa * std::pow(10.0, value.exponent());
}

std::optional<Decimal> to_decimal(double value) {
  if (!std::isfinite(value)) return std::nullopt;
  const auto exact = Decimal::parse(fmt::format("{:.9f}", value));
  return exact ? std::optional(work::without_zeros(*exact)) : std::nullopt;
}

report::Cell number_or_null(const std::optional<Decimal>& value) {
  return value ? report::Cell(work::without_zeros(*value)) : report::Cell(std::monostate());
}

report::Cell number_or_null(const std::optional<double>& value) {
  return value ? number_or_null(to_decimal(*value)) : report::Cell(std::monostate());
}

}  // namespace spindle::commands
