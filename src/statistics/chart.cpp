#include "spindle/statistics/chart.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

#include "spindle/statistics/moments.hpp"

namespace spindle::statistics {
namespace {

constexpr double d2_of_two = 1.128;
constexpr double upper_factor_of_two = 3.267;  // D4
constexpr std::size_t least_ranges = 19;
constexpr std::size_t least_baseline = 25;

/// sqrt(2 / (n - 1)) gamma(n / 2) / gamma((n - 1) / 2) of 5 values.
const double c4 = 0.75 * std::sqrt(std::numbers::pi / 2);
const double root_of_size = std::sqrt(static_cast<double>(subgroup_size));

void add_segment(const Series& series, const IndexRange& segment, Subgroups& groups) {
  const std::size_t whole = segment.count / subgroup_size;
  groups.left_over += segment.count % subgroup_size;
  if (whole > 0 && groups.size() > 0) groups.breaks.push_back(groups.size());
  for (std::size_t group = 0; group < whole; ++group) {
    const std::size_t first = segment.first + group * subgroup_size;
    const Moments moments = moments_of(series.values().subspan(first, subgroup_size));
    groups.means.push_back(moments.mean().value_or(0));
    groups.deviations.push_back(moments.deviation().value_or(0));
    groups.firsts.push_back(first);
  }
}

}  // namespace

double MovingRange::sigma() const { return mean / d2_of_two; }

double MovingRange::upper_limit() const { return upper_factor_of_two * mean; }

MovingRange moving_range(const Series& series) {
  MovingRange result;
  double sum = 0;
  for (const IndexRange& segment : series.segments()) {
    for (std::size_t at = segment.first + 1; at < segment.end(); ++at) {
      sum += std::abs(series[at] - series[at - 1]);
    }
    result.ranges += segment.count - 1;
  }
  if (result.ranges > 0) result.mean = sum / static_cast<double>(result.ranges);
  return result;
}

std::optional<double> within_deviation(const Series& series) {
  const MovingRange ranges = moving_range(series);
  if (ranges.ranges < least_ranges || ranges.mean <= 0) return std::nullopt;
  return ranges.sigma();
}

std::optional<double> autocorrelation(const Series& series) {
  const double mean = moments_of(series.values()).mean().value_or(0);
  double products = 0;
  double squares = 0;
  std::size_t pairs = 0;
  for (const IndexRange& segment : series.segments()) {
    double before = 0;
    for (std::size_t at = segment.first; at < segment.end(); ++at) {
      const double distance = series[at] - mean;
      products += before * distance;
      squares += distance * distance;
      before = distance;
    }
    pairs += segment.count - 1;
  }
  if (pairs == 0 || squares <= 0) return std::nullopt;
  const auto most_pairs = static_cast<double>(series.size() - 1);
  return products / squares * (most_pairs / static_cast<double>(pairs));
}

bool is_too_coarse(const MovingRange& ranges, double resolution) {
  constexpr double least_steps = 4;
  return ranges.ranges >= least_ranges && ranges.upper_limit() < least_steps * resolution;
}

Series Subgroups::points() const {
  // Means of values that a series has let in are let in too.
  return *Series::of(means, breaks);
}

Subgroups subgroups_of(const Series& series) {
  Subgroups groups;
  for (const IndexRange& segment : series.segments()) add_segment(series, segment, groups);
  return groups;
}

ControlLimits individuals_limits(double centre, const MovingRange& ranges) {
  return {.kind = ChartKind::individuals,
          .points = ranges.ranges + 1,
          .centre = centre,
          .sigma = ranges.sigma(),
          .lower = centre - 3 * ranges.sigma(),
          .upper = centre + 3 * ranges.sigma(),
          .spread_centre = ranges.mean,
          .spread_lower = 0,
          .spread_upper = ranges.upper_limit()};
}

std::optional<ControlLimits> individuals_limits(const Series& series, IndexRange baseline) {
  const Series part = series.part(baseline);
  if (part.size() < least_baseline || !within_deviation(part)) return std::nullopt;
  const double centre = moments_of(part.values()).mean().value_or(0);
  ControlLimits limits = individuals_limits(centre, moving_range(part));
  limits.baseline = {.first = baseline.first, .count = part.size()};
  limits.points = part.size();
  return limits;
}

std::optional<ControlLimits> subgroup_limits(const Subgroups& groups, IndexRange baseline) {
  Moments means;
  Moments deviations;
  for (std::size_t at = 0; at < groups.size(); ++at) {
    const std::size_t first = groups.firsts[at];
    if (first < baseline.first || first + subgroup_size > baseline.end()) continue;
    means.add(groups.means[at]);
    deviations.add(groups.deviations[at]);
  }
  const double s = deviations.mean().value_or(0);
  if (means.count() < least_baseline || s <= 0) return std::nullopt;
  const double centre = means.mean().value_or(0);
  const double sigma = s / (c4 * root_of_size);
  const double swing = 3 * std::sqrt(1 - c4 * c4) / c4;
  return ControlLimits{.kind = ChartKind::subgroups,
                       .baseline = baseline,
                       .points = means.count(),
                       .centre = centre,
                       .sigma = sigma,
                       .lower = centre - 3 * sigma,
                       .upper = centre + 3 * sigma,
                       .spread_centre = s,
                       .spread_lower = std::max(0.0, 1 - swing) * s,
                       .spread_upper = (1 + swing) * s};
}

}  // namespace spindle::statistics
