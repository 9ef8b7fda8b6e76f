#include "spindle/statistics/rules.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "statistics/distributions.hpp"

namespace spindle::statistics {
namespace {

std::size_t run_length(RuleSet rules) { return rules == RuleSet::atlas ? 7 : 8; }

/// How far a point is from the centre towards a side.
double distance_to(Side side, double point, const ControlLimits& limits) {
  return side == Side::upper ? point - limits.centre : limits.centre - point;
}

void find_beyond(const Series& points, const ControlLimits& limits, std::vector<Signal>& signals) {
  for (std::size_t at = 0; at < points.size(); ++at) {
    const bool is_above = points[at] > limits.upper;
    if (!is_above && !(points[at] < limits.lower)) continue;
    signals.push_back({.rule = Rule::beyond_limits,
                       .side = is_above ? Side::upper : Side::lower,
                       .index = at,
                       .points = {.first = at, .count = 1}});
  }
}

/// Runs of one segment on one side.
void find_runs(const Series& points, const ControlLimits& limits, const IndexRange& segment,
               Side side, std::size_t least, std::vector<Signal>& signals) {
  std::size_t first = segment.first;
  const auto end_run = [&](std::size_t end) {
    if (end - first < least) return;
    signals.push_back({.rule = Rule::one_side,
                       .side = side,
                       .index = first + least - 1,
                       .points = {.first = first, .count = end - first}});
  };
  for (std::size_t at = segment.first; at < segment.end(); ++at) {
    if (distance_to(side, points[at], limits) > 0) continue;
    end_run(at);
    first = at + 1;
  }
  end_run(segment.end());
}

/// A rule about most of the last few points.
struct Window {
  Rule rule;
  std::size_t size;
  std::size_t least;  ///< of them beyond the zone
  double sigmas;
};

constexpr std::array windows = {
    Window{.rule = Rule::two_of_three, .size = 3, .least = 2, .sigmas = 2},
    Window{.rule = Rule::four_of_five, .size = 5, .least = 4, .sigmas = 1},
};

void find_crowded(const Series& points, const ControlLimits& limits, const IndexRange& segment,
                  Side side, const Window& window, std::vector<Signal>& signals) {
  const auto is_beyond = [&](std::size_t at) {
    return distance_to(side, points[at], limits) > window.sigmas * limits.sigma;
  };
  std::size_t beyond = 0;  // of those in the window
  for (std::size_t at = segment.first; at < segment.end(); ++at) {
    const bool is_full = at - segment.first >= window.size;
    if (is_full && is_beyond(at - window.size)) --beyond;
    if (!is_beyond(at)) continue;
    ++beyond;
    if (beyond < window.least) continue;
    const std::size_t count = std::min(window.size, at - segment.first + 1);
    signals.push_back({.rule = window.rule,
                       .side = side,
                       .index = at,
                       .points = {.first = at + 1 - count, .count = count}});
  }
}

/// How often chance alone ends a window with a signal, of either side.
double chance_of(const Window& window) {
  const double p = normal_probability(-window.sigmas);
  const auto before = window.size - 1;
  // As many of those before the last are beyond too, or more.
  double enough = 0;
  double ways = 1;
  for (std::size_t beyond = 0; beyond <= before; ++beyond) {
    if (beyond > 0) ways *= static_cast<double>(before - beyond + 1) / static_cast<double>(beyond);
    if (beyond + 1 < window.least) continue;
    enough += ways * std::pow(p, beyond) * std::pow(1 - p, before - beyond);
  }
  return 2 * p * enough;
}

/// Variances of the errors of limits, in sigma of a point.
struct Errors {
  double centre = 0;
  double sigma = 0;
};

Errors errors_of(const ControlLimits& limits, std::size_t points) {
  if (limits.points == 0 || points == 0) return {};
  // Points of the baseline are judged by limits that they shaped themselves.
  const double shared =
      limits.from == LimitsFrom::this_series ? 1 / static_cast<double>(points) : 0;
  const double centre = std::max(0.0, 1 / static_cast<double>(limits.points) - shared);
  // Of sigma from moving ranges, which has 0.62 n degrees of freedom, and from s of 5 values.
  const double of_sigma = limits.kind == ChartKind::individuals ? 1 / (2 * 0.62) : 0.1317;
  return {.centre = centre, .sigma = of_sigma * centre};
}

/// Values of the standard normal distribution, close enough to sum over.
struct NormalPart {
  double weight;
  double z;
};

std::vector<NormalPart> normal_parts(double variance) {
  if (variance <= 0) return {{.weight = 1, .z = 0}};
  constexpr int half = 8;
  constexpr double step = 0.5;
  std::vector<NormalPart> parts;
  double sum = 0;
  for (int at = -half; at <= half; ++at) {
    const double z = step * at;
    parts.push_back({.weight = std::exp(-z * z / 2), .z = z});
    sum += parts.back().weight;
  }
  for (NormalPart& part : parts) part.weight /= sum;
  return parts;
}

/// The 95 % quantile of a count of mean `expected(centre, sigma)`, where the limits are off by
/// `centre` and their sigma is `sigma` times the right one.
std::size_t allowed(const Errors& errors, const std::function<double(double, double)>& expected) {
  std::vector<PoissonPart> mixture;
  for (const NormalPart& of_centre : normal_parts(errors.centre)) {
    for (const NormalPart& of_sigma : normal_parts(errors.sigma)) {
      const double centre = of_centre.z * std::sqrt(errors.centre);
      const double sigma = 1 + of_sigma.z * std::sqrt(errors.sigma);
      mixture.push_back(
          {.weight = of_centre.weight * of_sigma.weight, .mean = expected(centre, sigma)});
    }
  }
  return poisson_95(mixture);
}

/// Beyond which values a point counts, in sigma from the centre.
struct Thresholds {
  double beyond_lower = -3;
  double below_centre = 0;
  double above_centre = 0;
  double beyond_upper = 3;
};

/// Of points that are rounded to steps: those between two steps lie half-way.
Thresholds rounded(const ControlLimits& limits, double step) {
  const auto in_sigma = [&](double steps) { return (steps * step - limits.centre) / limits.sigma; };
  const auto below = [&](double limit) { return in_sigma(std::ceil(limit / step) - 0.5); };
  const auto above = [&](double limit) { return in_sigma(std::floor(limit / step) + 0.5); };
  return {.beyond_lower = below(limits.lower),
          .below_centre = below(limits.centre),
          .above_centre = above(limits.centre),
          .beyond_upper = above(limits.upper)};
}

/// Without rounding, and with it where there is any. What is allowed is the larger count: rounding
/// excuses signals, but that it makes them rarer accuses nothing.
std::vector<Thresholds> thresholds_of(const ControlLimits& limits, double step) {
  std::vector<Thresholds> thresholds = {{}};
  if (step > 0 && limits.sigma > 0) thresholds.push_back(rounded(limits, step));
  return thresholds;
}

RuleCount beyond_count(double points, const Errors& errors,
                       const std::vector<Thresholds>& thresholds) {
  RuleCount result{.rule = Rule::beyond_limits, .expected = points / 370, .allowed = 0};
  const double known = 2 * normal_probability(-3);
  for (const Thresholds& at : thresholds) {
    const auto with_errors = [&](double centre, double sigma) {
      const double share = normal_probability(at.beyond_lower * sigma - centre) +
                           normal_probability(centre - at.beyond_upper * sigma);
      return result.expected * share / known;
    };
    result.allowed = std::max(*result.allowed, allowed(errors, with_errors));
  }
  return result;
}

RuleCount run_count(double points, const Errors& errors, RuleSet rules,
                    const std::vector<Thresholds>& thresholds) {
  const auto length = static_cast<double>(run_length(rules));
  RuleCount result{.rule = Rule::one_side, .expected = points / std::exp2(length), .allowed = 0};
  const Errors of_centre{.centre = errors.centre, .sigma = 0};
  for (const Thresholds& at : thresholds) {
    const auto with_errors = [&](double centre, double) {
      const double below = normal_probability(at.below_centre - centre);
      const double above = normal_probability(centre - at.above_centre);
      // The one before it not on this side, then all of them on it.
      return points *
             ((1 - below) * std::pow(below, length) + (1 - above) * std::pow(above, length));
    };
    result.allowed = std::max(*result.allowed, allowed(of_centre, with_errors));
  }
  return result;
}

}  // namespace

std::vector<Signal> find_signals(const Series& points, const ControlLimits& limits, RuleSet rules) {
  std::vector<Signal> signals;
  find_beyond(points, limits, signals);
  for (const IndexRange& segment : points.segments()) {
    for (const Side side : {Side::lower, Side::upper}) {
      find_runs(points, limits, segment, side, run_length(rules), signals);
      if (rules != RuleSet::western_electric) continue;
      for (const Window& window : windows) {
        find_crowded(points, limits, segment, side, window, signals);
      }
    }
  }
  std::stable_sort(signals.begin(), signals.end(),
                   [](const Signal& a, const Signal& b) { return a.index < b.index; });
  return signals;
}

std::vector<Period> shifted_periods(const std::vector<Signal>& signals, RuleSet rules) {
  std::vector<Period> periods;
  for (const Signal& signal : signals) {
    if (signal.rule != Rule::one_side) continue;
    const bool continues = !periods.empty() && periods.back().side == signal.side &&
                           signal.points.first - periods.back().points.end() < run_length(rules);
    if (continues) {
      IndexRange& points = periods.back().points;
      points.count = signal.points.end() - points.first;
    } else {
      periods.push_back({.side = signal.side, .points = signal.points});
    }
  }
  return periods;
}

std::size_t Stability::signals() const {
  std::size_t sum = 0;
  for (const RuleCount& count : counts) sum += count.signals;
  return sum;
}

double Stability::expected() const {
  double sum = 0;
  for (const RuleCount& count : counts) sum += count.expected;
  return sum;
}

Stability judge(const std::vector<Signal>& signals, const ControlLimits& limits, RuleSet rules,
                const Surroundings& surroundings) {
  const auto points = static_cast<double>(surroundings.points);
  const Errors errors = errors_of(limits, surroundings.points);
  Stability result{.autocorrelation = surroundings.autocorrelation};
  result.is_greyed = surroundings.autocorrelation.value_or(0) > greying_autocorrelation;
  const std::vector<Thresholds> thresholds = thresholds_of(limits, surroundings.step);
  result.counts = {beyond_count(points, errors, thresholds),
                   run_count(points, errors, rules, thresholds)};
  if (rules == RuleSet::western_electric) {
    for (const Window& window : windows) {
      result.counts.push_back({.rule = window.rule, .expected = points * chance_of(window)});
    }
  }
  bool is_explained = true;
  for (RuleCount& count : result.counts) {
    count.signals = static_cast<std::size_t>(
        std::count_if(signals.begin(), signals.end(),
                      [&](const Signal& signal) { return signal.rule == count.rule; }));
    if (count.allowed && count.signals > *count.allowed) is_explained = false;
  }
  if (surroundings.is_too_coarse) return result;
  if (!is_explained) {
    result.verdict = Verdict::unstable;
  } else if (!result.is_greyed) {
    result.verdict = Verdict::stable;
  }
  return result;
}

}  // namespace spindle::statistics
