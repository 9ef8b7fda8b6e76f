#include "spindle/statistics/assessment.hpp"

#include <algorithm>
#include <utility>

namespace spindle::statistics {
namespace {

ChartKind kind_of(const Series& series, const AssessmentOptions& options) {
  if (options.frozen) return options.frozen->kind;
  return series.size() > most_individuals ? ChartKind::subgroups : ChartKind::individuals;
}

/// As many of the first values as make limits that are as good as the series is long.
IndexRange usual_range(const Series& series, const Subgroups& groups) {
  constexpr std::size_t enough = least_baseline / subgroup_size;
  const std::size_t least =
      groups.size() < enough ? least_baseline : groups.firsts[enough - 1] + subgroup_size;
  return {.first = 0, .count = std::min(std::max(least, series.size() / 4), series.size())};
}

std::optional<ControlLimits> limits_of(const Series& series, const Subgroups& groups,
                                       ChartKind kind, const AssessmentOptions& options) {
  if (options.frozen) {
    ControlLimits limits = *options.frozen;
    limits.from = LimitsFrom::another_series;
    return limits;
  }
  IndexRange baseline = options.baseline.value_or(usual_range(series, groups));
  baseline.first = std::min(baseline.first, series.size());
  baseline.count = std::min(baseline.count, series.size() - baseline.first);
  return kind == ChartKind::subgroups ? subgroup_limits(groups, baseline)
                                      : individuals_limits(series, baseline);
}

std::optional<Chart> chart_of(const Series& series, const Assessment& known,
                              const AssessmentOptions& options) {
  const ChartKind kind = kind_of(series, options);
  Subgroups groups;
  if (kind == ChartKind::subgroups) groups = subgroups_of(series);
  const std::optional<ControlLimits> limits = limits_of(series, groups, kind, options);
  if (!limits) return std::nullopt;
  const Series points = kind == ChartKind::subgroups ? groups.points() : series;
  Chart chart{.limits = *limits};
  chart.signals = find_signals(points, chart.limits, options.rules);
  chart.periods = shifted_periods(chart.signals, options.rules);
  chart.stability = judge(chart.signals, chart.limits, options.rules,
                          {.points = points.size(),
                           .step = kind == ChartKind::subgroups
                                       ? options.resolution / static_cast<double>(subgroup_size)
                                       : options.resolution,
                           .autocorrelation = known.autocorrelation,
                           .is_too_coarse = known.is_too_coarse});
  chart.subgroups = std::move(groups);
  return chart;
}

}  // namespace

IndexRange Chart::values_of(IndexRange points) const {
  if (limits.kind == ChartKind::individuals || points.count == 0) return points;
  const std::size_t first = subgroups.firsts[points.first];
  const std::size_t last = subgroups.firsts[points.end() - 1];
  return {.first = first, .count = last + subgroup_size - first};
}

Assessment assess(const Series& series, const Specification& specification,
                  const AssessmentOptions& options) {
  Assessment result{.moments = moments_of(series.values()),
                    .within = within_deviation(series),
                    .autocorrelation = autocorrelation(series),
                    .is_too_coarse = is_too_coarse(moving_range(series), options.resolution)};
  result.chart = chart_of(series, result, options);
  result.performance = performance(result.moments, specification);
  if (result.chart) {
    result.capability = capability(series, specification, result.chart->stability);
  }
  result.percentile = percentile_performance(series, specification, result.performance);
  result.normality = normality(series);
  return result;
}

}  // namespace spindle::statistics
