#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "spindle/statistics/series.hpp"

namespace spindle::statistics {

/// The differences between neighbours, |x[i] - x[i-1]|, never across an interruption.
struct MovingRange {
  std::size_t ranges = 0;  ///< how many there are
  double mean = 0;         ///< 0 when there are none

  /// MR / d2 with d2 = 1.128 (two values a range): what the values spread from one to the next.
  double sigma() const;
  /// 3.267 MR.
  double upper_limit() const;
};

MovingRange moving_range(const Series& series);

/// sigma_within. Nothing below 19 ranges, which are those of 20 values without an interruption, and
/// nothing when no value differs from its neighbour.
std::optional<double> within_deviation(const Series& series);

/// Correlation of neighbours: the mean of (x[i] - mean)(x[i-1] - mean) over all pairs of
/// neighbours, by the sum of squares / (n - 1). Without an interruption it is r1 as NIST defines
/// it. Nothing when there are no neighbours or all values are equal.
std::optional<double> autocorrelation(const Series& series);

/// Whether the upper limit of the moving range holds fewer than four steps of the resolution:
/// sigma, limits and signals are then artefacts of rounding. Not said below 19 ranges.
bool is_too_coarse(const MovingRange& ranges, double resolution);

inline constexpr std::size_t subgroup_size = 5;

/// The series cut into subgroups of 5 neighbours. None spans an interruption: what is left over
/// before one, or at the end, is in no subgroup.
struct Subgroups {
  std::vector<double> means = {};
  std::vector<double> deviations = {};   ///< s with n - 1
  std::vector<std::size_t> firsts = {};  ///< index of the first value of each
  std::vector<std::size_t> breaks = {};  ///< subgroups before which the series is interrupted
  std::size_t left_over = 0;             ///< values in no subgroup

  std::size_t size() const { return means.size(); }
  /// The means as points of a chart. Looks at `means`.
  Series points() const;
};

Subgroups subgroups_of(const Series& series);

enum class ChartKind : std::uint8_t {
  individuals,  ///< a point is a value (I-MR)
  subgroups,    ///< a point is the mean of a subgroup (X-S)
};

enum class LimitsFrom : std::uint8_t { this_series, another_series };

/// Control limits: they come from the values of the baseline, never from a specification, and
/// other values than those of the baseline leave them as they are.
struct ControlLimits {
  ChartKind kind = ChartKind::individuals;
  LimitsFrom from = LimitsFrom::this_series;
  IndexRange baseline = {};  ///< values that they were computed from
  std::size_t points = 0;    ///< points of the chart in the baseline
  double centre = 0;         ///< mean of the baseline's points
  double sigma = 0;          ///< of a point: MR / 1.128, or s / (c4 sqrt 5)
  double lower = 0;          ///< centre - 3 sigma
  double upper = 0;          ///< centre + 3 sigma
  double spread_centre = 0;  ///< MR, or s
  double spread_lower = 0;   ///< 0, or B3 s
  double spread_upper = 0;   ///< 3.267 MR, or B4 s
};

/// Limits of an I-MR chart, however few values there are.
ControlLimits individuals_limits(double centre, const MovingRange& ranges);

/// Limits of an I-MR chart from the values of `baseline`. Nothing below 25 values, and where there
/// is no within_deviation().
std::optional<ControlLimits> individuals_limits(const Series& series, IndexRange baseline);

/// Limits of an X-S chart from the subgroups that lie in `baseline` with all of their values, with
/// A3, B3 and B4 of 5 values. Nothing below 25 subgroups, and when no value differs from the others
/// of its subgroup.
std::optional<ControlLimits> subgroup_limits(const Subgroups& groups, IndexRange baseline);

}  // namespace spindle::statistics
