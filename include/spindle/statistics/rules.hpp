#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "spindle/statistics/chart.hpp"
#include "spindle/statistics/series.hpp"

namespace spindle::statistics {

enum class Rule : std::uint8_t {
  beyond_limits,  ///< one point beyond 3 sigma (rule 1)
  one_side,       ///< 8 in a row on one side of the centre (rule 4); 7 with RuleSet::atlas
  two_of_three,   ///< the last and one of the two before it beyond 2 sigma of one side
  four_of_five,   ///< the last and three of the four before it beyond 1 sigma of one side
};

enum class RuleSet : std::uint8_t {
  standard,          ///< beyond_limits, one_side
  atlas,             ///< the same with 7 in a row
  western_electric,  ///< all four
};

enum class Side : std::uint8_t { lower, upper };

/// Points that chance alone seldom brings. No rule looks across an interruption. A point on the
/// centre or on a limit is on no side and not beyond.
struct Signal {
  Rule rule = Rule::beyond_limits;
  Side side = Side::lower;
  std::size_t index = 0;   ///< point at which the rule was met; of a run the eighth (seventh)
  IndexRange points = {};  ///< of a run all of it; else those that the rule looks at
};

/// Signals in order of the points; a run is one signal, however long it is.
std::vector<Signal> find_signals(const Series& points, const ControlLimits& limits, RuleSet rules);

/// A stretch in which the mean was lower or higher than the centre.
struct Period {
  Side side = Side::lower;
  IndexRange points = {};
};

/// The runs among the signals; those of one side that fewer points part than a run has are one.
std::vector<Period> shifted_periods(const std::vector<Signal>& signals, RuleSet rules);

enum class Verdict : std::uint8_t {
  stable,
  unstable,
  not_judged,  ///< resolution too coarse, or neighbours depend on each other (see `is_greyed`)
};

struct RuleCount {
  Rule rule = Rule::beyond_limits;
  std::size_t signals = 0;
  double expected = 0;  ///< as many come by chance
  /// More do not come in 95 % of all cases. Nothing: the rule is no part of the verdict.
  std::optional<std::size_t> allowed = {};
};

/// Correlation of neighbours above which sigma from moving ranges is too small and the rules signal
/// far too often.
inline constexpr double greying_autocorrelation = 0.2;

/// Whether there are more signals than chance explains.
struct Stability {
  Verdict verdict = Verdict::not_judged;
  std::optional<double> autocorrelation = {};
  bool is_greyed = false;  ///< autocorrelation above 0.2: signals say little
  std::vector<RuleCount> counts = {};

  std::size_t signals() const;
  double expected() const;
};

/// What stands beside the signals of a chart when they are judged.
struct Surroundings {
  std::size_t points = 0;  ///< of the chart
  double step = 0;         ///< between two values that a point can have; 0: any
  std::optional<double> autocorrelation = {};
  bool is_too_coarse = false;
};

/// Count test. Of n points, n / 370 are beyond the limits by chance, and n / 2^k runs of k begin:
/// two of the 2^(k+1) ways that a point and the k behind it can fall, so n / 256, or n / 128 for 7.
/// The verdict is `stable` when no count is larger than the 95 % quantile of the Poisson
/// distribution of that mean. The quantile is larger where less is known of the limits:
///   - Where the baseline is not all that is judged, centre and sigma have errors, and it is that
///   of
///     the mixture which they bring. Without it, half of all stable series of 1,200 would be
///     unstable by a baseline of 25.
///   - Where points are rounded, more of them may lie on one side of the centre or beyond a limit.
///     Without it, half of all stable series of 2,000 would be unstable when sigma is 1.5 steps.
/// The other two rules are counted beside what chance brings and are no part of the verdict: their
/// signals come in clusters.
Stability judge(const std::vector<Signal>& signals, const ControlLimits& limits, RuleSet rules,
                const Surroundings& surroundings);

}  // namespace spindle::statistics
