#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "spindle/statistics/capability.hpp"
#include "spindle/statistics/chart.hpp"
#include "spindle/statistics/histogram.hpp"
#include "spindle/statistics/moments.hpp"
#include "spindle/statistics/normality.hpp"
#include "spindle/statistics/rules.hpp"
#include "spindle/statistics/series.hpp"

namespace spindle::statistics {

/// More values are charted as subgroups.
inline constexpr std::size_t most_individuals = 2000;
/// Of a baseline that is not given: 25 subgroups.
inline constexpr std::size_t least_baseline = 125;

struct AssessmentOptions {
  RuleSet rules = RuleSet::standard;
  /// Values that the control limits are computed from. Without: the first quarter of the series,
  /// but not less than 125 values and in a chart of subgroups 25 of them.
  std::optional<IndexRange> baseline = {};
  /// Limits of another series, to be kept; then `baseline` is not looked at.
  std::optional<ControlLimits> frozen = {};
  double resolution = usual_resolution;
};

/// What a control chart shows. Points are values, or subgroups when limits.kind says so.
struct Chart {
  ControlLimits limits = {};
  Subgroups subgroups = {};  ///< empty in a chart of individuals
  std::vector<Signal> signals = {};
  std::vector<Period> periods = {};  ///< in which the mean was shifted
  Stability stability = {};

  /// The values that points of the chart stand for.
  IndexRange values_of(IndexRange points) const;
};

/// Everything that is said of one quantity of one stratum, in the order in which it is to be
/// believed: stability comes before capability.
struct Assessment {
  Moments moments = {};
  std::optional<double> within = {};  ///< sigma from moving ranges
  std::optional<double> autocorrelation = {};
  bool is_too_coarse = false;       ///< the resolution, for moving ranges
  std::optional<Chart> chart = {};  ///< nothing where there are no control limits
  Indices performance = {};
  std::optional<Indices> capability = {};  ///< only while stable
  std::optional<PercentileIndex> percentile = {};
  std::optional<Normality> normality = {};
};

Assessment assess(const Series& series, const Specification& specification,
                  const AssessmentOptions& options = {});

}  // namespace spindle::statistics
