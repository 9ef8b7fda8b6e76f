#include "spindle/statistics/histogram.hpp"

#include <algorithm>
#include <cmath>

namespace spindle::statistics {
namespace {

/// Whole numbers up to it are told apart by a double.
constexpr double most_steps = 9007199254740992;

/// The values in steps of the resolution; empty when one has no step.
std::vector<std::int64_t> steps_of(const Series& series, double resolution) {
  std::vector<std::int64_t> steps;
  steps.reserve(series.size());
  for (const double value : series.values()) {
    const double step = value / resolution;
    if (!(std::abs(step) < most_steps)) return {};
    steps.push_back(std::llround(step));
  }
  return steps;
}

/// The step at a quarter, a half, … of the values. Puts them into another order.
std::int64_t quantile(std::vector<std::int64_t>& steps, double p) {
  const auto index = static_cast<std::ptrdiff_t>(p * static_cast<double>(steps.size() - 1));
  std::nth_element(steps.begin(), steps.begin() + index, steps.end());
  return steps[static_cast<std::size_t>(index)];
}

}  // namespace

double Histogram::width() const { return static_cast<double>(steps) * resolution; }

double Histogram::edge(std::size_t index) const {
  const std::int64_t step = first_step + static_cast<std::int64_t>(index) * steps;
  return (static_cast<double>(step) - 0.5) * resolution;
}

std::optional<Histogram> histogram(const Series& series, double resolution,
                                   std::size_t most_classes) {
  if (!(resolution > 0) || !std::isfinite(resolution) || most_classes == 0) return std::nullopt;
  std::vector<std::int64_t> steps = steps_of(series, resolution);
  if (steps.empty()) return std::nullopt;

  const auto [lowest, highest] = std::minmax_element(steps.begin(), steps.end());
  Histogram result{.resolution = resolution, .first_step = *lowest};
  const std::int64_t span = *highest - *lowest + 1;
  const auto classes =
      static_cast<std::int64_t>(std::min(most_classes, static_cast<std::size_t>(span)));
  const std::int64_t middle_half = quantile(steps, 0.75) - quantile(steps, 0.25);
  const double wanted =
      2 * static_cast<double>(middle_half) / std::cbrt(static_cast<double>(steps.size()));
  result.steps = std::max(
      {std::int64_t{1}, std::int64_t{std::llround(wanted)}, (span + classes - 1) / classes});
  result.counts.resize(static_cast<std::size_t>((span + result.steps - 1) / result.steps));
  for (const std::int64_t step : steps) {
    ++result.counts[static_cast<std::size_t>((step - result.first_step) / result.steps)];
  }
  return result;
}

}  // namespace spindle::statistics
