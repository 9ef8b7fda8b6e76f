#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <limits>
#include <numbers>
#include <optional>
#include <random>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "spindle/statistics/assessment.hpp"
#include "spindle/statistics/capability.hpp"
#include "spindle/statistics/chart.hpp"
#include "spindle/statistics/counts.hpp"
#include "spindle/statistics/histogram.hpp"
#include "spindle/statistics/moments.hpp"
#include "spindle/statistics/normality.hpp"
#include "spindle/statistics/rules.hpp"
#include "spindle/statistics/series.hpp"
#include "statistics/distributions.hpp"

using namespace spindle::statistics;
using doctest::Approx;

namespace {

using Values = std::vector<double>;
using Breaks = std::vector<std::size_t>;

constexpr double no_number = std::numeric_limits<double>::quiet_NaN();
constexpr double infinity = std::numeric_limits<double>::infinity();

/// Independent normal values; the same everywhere for the same seed.
class Normal {
 public:
  explicit Normal(std::uint64_t seed) : engine_(seed) {}

  double next() {
    const double radius = std::sqrt(-2 * std::log(1 - uniform()));
    return radius * std::cos(2 * std::numbers::pi * uniform());
  }

  Values values(std::size_t count, double mean = 0, double deviation = 1) {
    Values values(count);
    for (double& value : values) value = mean + deviation * next();
    return values;
  }

 private:
  double uniform() { return static_cast<double>(engine_() >> 11U) * 0x1p-53; }

  std::mt19937_64 engine_;
};

Series series_of(const Values& values, const Breaks& breaks = {}) {
  const auto series = Series::of(values, breaks);
  REQUIRE(series);
  return *series;
}

/// So many of each value, one behind the other.
Values joined(std::initializer_list<std::pair<std::size_t, double>> parts) {
  Values values;
  for (const auto& [count, value] : parts) values.insert(values.end(), count, value);
  return values;
}

Values appended(Values values, const Values& more) {
  values.insert(values.end(), more.begin(), more.end());
  return values;
}

/// A chart of centre 0 and sigma 1.
const ControlLimits unit_limits = {.points = 0, .sigma = 1, .lower = -3, .upper = 3};

/// Values around 0 whose neighbours differ: by nothing that a rule signals.
Values quiet(std::size_t count, double deviation = 1) {
  constexpr std::array pattern = {0.3, -0.5, 0.9, -0.2, -0.8, 0.6, 0.1, -1.1, 0.7};
  Values values(count);
  for (std::size_t at = 0; at < count; ++at) values[at] = deviation * pattern[at % pattern.size()];
  return values;
}

Values numacc(double first, double low, double high) {
  Values values = {first};
  for (int pair = 0; pair < 500; ++pair) values.insert(values.end(), {low, high});
  return values;
}

// Of the Statistical Reference Datasets of NIST, univariate.
const Values michelso = {
    299.85, 299.74, 299.90, 300.07, 299.93, 299.85, 299.95, 299.98, 299.98, 299.88, 300.00, 299.98,
    299.93, 299.65, 299.76, 299.81, 300.00, 300.00, 299.96, 299.96, 299.96, 299.94, 299.96, 299.94,
    299.88, 299.80, 299.85, 299.88, 299.90, 299.84, 299.83, 299.79, 299.81, 299.88, 299.88, 299.83,
    299.80, 299.79, 299.76, 299.80, 299.88, 299.88, 299.88, 299.86, 299.72, 299.72, 299.62, 299.86,
    299.97, 299.95, 299.88, 299.91, 299.85, 299.87, 299.84, 299.84, 299.85, 299.84, 299.84, 299.84,
    299.89, 299.81, 299.81, 299.82, 299.80, 299.77, 299.76, 299.74, 299.75, 299.76, 299.91, 299.92,
    299.89, 299.86, 299.88, 299.72, 299.84, 299.85, 299.85, 299.78, 299.89, 299.84, 299.78, 299.81,
    299.76, 299.81, 299.79, 299.81, 299.82, 299.85, 299.87, 299.87, 299.81, 299.74, 299.81, 299.94,
    299.95, 299.80, 299.81, 299.87};
const Values mavro = {
    2.00180, 2.00170, 2.00180, 2.00190, 2.00180, 2.00170, 2.00150, 2.00140, 2.00150, 2.00150,
    2.00170, 2.00180, 2.00180, 2.00190, 2.00190, 2.00210, 2.00200, 2.00160, 2.00140, 2.00130,
    2.00130, 2.00150, 2.00150, 2.00160, 2.00150, 2.00140, 2.00130, 2.00140, 2.00150, 2.00140,
    2.00150, 2.00160, 2.00150, 2.00160, 2.00190, 2.00200, 2.00200, 2.00210, 2.00220, 2.00230,
    2.00240, 2.00250, 2.00270, 2.00260, 2.00260, 2.00260, 2.00270, 2.00260, 2.00250, 2.00240};
const Values lew = {
    -213, -564, -35,  -15,  141,  115,  -420, -360, 203,  -338, -431, 194,  -220, -513, 154,  -125,
    -559, 92,   -21,  -579, -52,  99,   -543, -175, 162,  -457, -346, 204,  -300, -474, 164,  -107,
    -572, -8,   83,   -541, -224, 180,  -420, -374, 201,  -236, -531, 83,   27,   -564, -112, 131,
    -507, -254, 199,  -311, -495, 143,  -46,  -579, -90,  136,  -472, -338, 202,  -287, -477, 169,
    -124, -568, 17,   48,   -568, -135, 162,  -430, -422, 172,  -74,  -577, -13,  92,   -534, -243,
    194,  -355, -465, 156,  -81,  -578, -64,  139,  -449, -384, 193,  -198, -538, 110,  -44,  -577,
    -6,   66,   -552, -164, 161,  -460, -344, 205,  -281, -504, 134,  -28,  -576, -118, 156,  -437,
    -381, 200,  -220, -540, 83,   11,   -568, -160, 172,  -414, -408, 188,  -125, -572, -32,  139,
    -492, -321, 205,  -262, -504, 142,  -83,  -574, 0,    48,   -571, -106, 137,  -501, -266, 190,
    -391, -406, 194,  -186, -553, 83,   -13,  -577, -49,  103,  -515, -280, 201,  300,  -506, 131,
    -45,  -578, -80,  138,  -462, -361, 201,  -211, -554, 32,   74,   -533, -235, 187,  -372, -442,
    182,  -147, -566, 25,   68,   -535, -244, 194,  -351, -463, 174,  -125, -570, 15,   72,   -550,
    -190, 172,  -424, -385, 198,  -218, -536, 96};

// I-MR of the NIST handbook, 6.3.2.2.
const Values flow_rate = {49.6, 47.6, 49.9, 51.3, 47.8, 51.2, 52.6, 52.4, 53.6, 52.1};

}  // namespace

// ---- values and their moments ----

TEST_CASE("mean, deviation and autocorrelation are those that NIST certifies") {
  struct Case {
    const char* name;
    Values values;
    double mean;
    double deviation;
    double autocorrelation;
    double tolerance;  ///< relative; what the values as doubles allow
  };
  const Case cases[] = {
      {"Michelso", michelso, 299.8524, 0.0790105478190518, 0.535199668621283, 1e-12},
      {"Mavro", mavro, 2.001856, 0.000429123454003053, 0.937989183438248, 1e-12},
      {"Lew", lew, -177.435, 277.332168044316, -0.307304800605679, 1e-14},
      {"NumAcc1", {10000001, 10000003, 10000002}, 10000002, 1, -0.5, 1e-15},
      {"NumAcc2", numacc(1.2, 1.1, 1.3), 1.2, 0.1, -0.999, 1e-14},
      {"NumAcc3", numacc(1000000.2, 1000000.1, 1000000.3), 1000000.2, 0.1, -0.999, 1e-9},
      {"NumAcc4", numacc(10000000.2, 10000000.1, 10000000.3), 10000000.2, 0.1, -0.999, 1e-7},
  };
  for (const Case& row : cases) {
    CAPTURE(row.name);
    const Series series = series_of(row.values);
    const Moments moments = moments_of(series.values());
    CHECK(*moments.mean() == Approx(row.mean).epsilon(1e-14));
    CHECK(std::abs(*moments.deviation() / row.deviation - 1) <= row.tolerance);
    CHECK(std::abs(*autocorrelation(series) / row.autocorrelation - 1) <= row.tolerance);
  }
}

TEST_CASE("shape is told as scipy tells it") {
  const Moments moments = moments_of(flow_rate);
  CHECK(moments.count() == 10);
  CHECK(*moments.min() == 47.6);
  CHECK(*moments.max() == 53.6);
  CHECK(*moments.skewness() == Approx(-0.4047723250969197).epsilon(1e-12));
  CHECK(*moments.excess_kurtosis() == Approx(-1.0433672241049783).epsilon(1e-12));
}

TEST_CASE("moments of parts add up to those of the whole") {
  const Values values = Normal(7).values(1000, 5, 2);
  const Moments whole = moments_of(values);
  for (const std::size_t cut : {0U, 1U, 2U, 500U, 999U, 1000U}) {
    CAPTURE(cut);
    const std::span<const double> all(values);
    Moments parts = moments_of(all.first(cut));
    parts.merge(moments_of(all.subspan(cut)));
    CHECK(parts.count() == whole.count());
    CHECK(*parts.mean() == Approx(*whole.mean()).epsilon(1e-13));
    CHECK(*parts.deviation() == Approx(*whole.deviation()).epsilon(1e-13));
    CHECK(*parts.skewness() == Approx(*whole.skewness()).epsilon(1e-11));
    CHECK(*parts.excess_kurtosis() == Approx(*whole.excess_kurtosis()).epsilon(1e-11));
    CHECK(parts.min() == whole.min());
    CHECK(parts.max() == whole.max());
  }
}

TEST_CASE("moments without enough values are nothing") {
  Moments moments;
  CHECK_FALSE(moments.mean());
  CHECK_FALSE(moments.min());
  CHECK_FALSE(moments.max());
  for (const double value : {no_number, infinity, -infinity}) moments.add(value);
  CHECK(moments.count() == 0);
  CHECK_FALSE(moments.mean());
  moments.add(3);
  CHECK(moments.mean() == 3);
  CHECK_FALSE(moments.deviation());
  CHECK_FALSE(moments.skewness());
  moments.add(3);
  CHECK(moments.deviation() == 0);
  CHECK_FALSE(moments.skewness());
  CHECK_FALSE(moments.excess_kurtosis());
}

TEST_CASE("a series has only values that can have been measured") {
  for (const double value : {no_number, infinity, -infinity, 1e61, -1e61}) {
    CAPTURE(value);
    CHECK_FALSE(Series::of(Values{1, value, 2}));
  }
  CHECK(Series::of(Values{1e60, -1e60}));
}

TEST_CASE("a series is cut where its order is interrupted") {
  const Values values(10, 1.0);
  const auto segments = [&](const Breaks& breaks) {
    const Series series = series_of(values, breaks);
    return std::vector<IndexRange>(series.segments().begin(), series.segments().end());
  };
  CHECK(segments({}) == std::vector<IndexRange>{{0, 10}});
  CHECK(segments({4}) == std::vector<IndexRange>{{0, 4}, {4, 6}});
  CHECK(segments({9, 0, 10, 11, 4, 4}) == std::vector<IndexRange>{{0, 4}, {4, 5}, {9, 1}});
  CHECK(series_of({}, {0, 1}).segments().empty());

  const Series part = series_of(values, {4}).part({.first = 3, .count = 3});
  CHECK(part.size() == 3);
  CHECK(std::vector<IndexRange>(part.segments().begin(), part.segments().end()) ==
        std::vector<IndexRange>{{0, 1}, {1, 2}});
  CHECK(series_of(values).part({.first = 8, .count = 99}).size() == 2);
  CHECK(series_of(values).part({.first = 99, .count = 1}).size() == 0);
}

// ---- charts ----

TEST_CASE("I-MR limits of the published example") {
  const Series series = series_of(flow_rate);
  const MovingRange ranges = moving_range(series);
  CHECK(ranges.ranges == 9);
  CHECK(ranges.mean == Approx(1.8778).epsilon(1e-4));
  const ControlLimits limits = individuals_limits(*moments_of(series.values()).mean(), ranges);
  CHECK(limits.centre == Approx(50.81).epsilon(1e-12));
  CHECK(limits.upper == Approx(55.8041).epsilon(1e-6));
  CHECK(limits.lower == Approx(45.8159).epsilon(1e-6));
  CHECK(limits.spread_upper == Approx(6.1347).epsilon(1e-5));
  CHECK(limits.spread_lower == 0);
  CHECK(limits.points == 10);
}

TEST_CASE("sigma within needs 20 values, and limits need 25") {
  const Values values = quiet(60);
  const auto part = [&](std::size_t count) { return series_of(values).part({0, count}); };
  CHECK_FALSE(within_deviation(part(19)));
  CHECK(within_deviation(part(20)));
  CHECK_FALSE(individuals_limits(series_of(values), {.first = 10, .count = 24}));
  const auto limits = individuals_limits(series_of(values), {.first = 10, .count = 25});
  REQUIRE(limits);
  CHECK(limits->baseline == IndexRange{.first = 10, .count = 25});
  CHECK_FALSE(individuals_limits(series_of(values), {.first = 40, .count = 25}));
  CHECK_FALSE(within_deviation(series_of(Values(60, 2.71))));
  CHECK_FALSE(individuals_limits(series_of(Values(60, 2.71)), {.first = 0, .count = 60}));
}

TEST_CASE("where every value stands alone there is no moving range") {
  const Values values = quiet(40);
  Breaks breaks(40);
  for (std::size_t at = 0; at < 40; ++at) breaks[at] = at;
  const Series series = series_of(values, breaks);
  CHECK(moving_range(series).ranges == 0);
  CHECK(moving_range(series).mean == 0);
  CHECK_FALSE(within_deviation(series));
  CHECK_FALSE(autocorrelation(series));
}

TEST_CASE("X-S limits have the constants of subgroups of 5") {
  Values values = Normal(3).values(125, 10, 2);
  const Subgroups groups = subgroups_of(series_of(values));
  REQUIRE(groups.size() == 25);
  const auto limits = subgroup_limits(groups, {.first = 0, .count = 125});
  REQUIRE(limits);
  const double s = limits->spread_centre;
  CHECK(limits->centre == Approx(*moments_of(values).mean()));
  CHECK(s == Approx(*moments_of(groups.deviations).mean()));
  CHECK((limits->upper - limits->centre) / s == Approx(1.427).epsilon(4e-4));  // A3
  CHECK((limits->centre - limits->lower) / s == Approx(1.427).epsilon(4e-4));
  CHECK(limits->spread_lower == 0);                                         // B3
  CHECK(limits->spread_upper / s == Approx(2.089).epsilon(3e-4));           // B4
  CHECK(s / (limits->sigma * std::sqrt(5.0)) == Approx(0.93998560298663));  // c4
  CHECK(limits->points == 25);
  CHECK_FALSE(subgroup_limits(groups, {.first = 0, .count = 124}));
  CHECK_FALSE(subgroup_limits(groups, {.first = 1, .count = 124}));
  CHECK_FALSE(subgroup_limits(subgroups_of(series_of(Values(500, 1.0))), {0, 500}));
}

TEST_CASE("no subgroup spans an interruption") {
  Values values(23);
  for (std::size_t at = 0; at < values.size(); ++at) values[at] = static_cast<double>(at);
  const Subgroups groups = subgroups_of(series_of(values, {7, 9, 14}));
  CHECK(groups.firsts == std::vector<std::size_t>{0, 9, 14});
  CHECK(groups.means == Values{2, 11, 16});
  CHECK(groups.breaks == std::vector<std::size_t>{1, 2});
  CHECK(groups.left_over == 2 + 2 + 4);
  CHECK(groups.points().segments().size() == 3);
}

TEST_CASE("autocorrelation leaves out pairs that an interruption parts") {
  // Within each half neighbours are opposite; across the cut they are equal.
  const Values values = {1, -1, 1, -1, -1, 1, -1, 1};
  CHECK(*autocorrelation(series_of(values, {4})) == Approx(-7.0 / 8));
  CHECK(*autocorrelation(series_of(values)) == Approx(-5.0 / 8));
}

// ---- rules ----

TEST_CASE("a point beyond three sigma is a signal of its side") {
  const auto signals =
      find_signals(series_of({0, 3, 3.01, -3, -3.01}), unit_limits, RuleSet::standard);
  REQUIRE(signals.size() == 2);
  CHECK(signals[0].rule == Rule::beyond_limits);
  CHECK(signals[0].side == Side::upper);
  CHECK(signals[0].index == 2);
  CHECK(signals[1].side == Side::lower);
  CHECK(signals[1].points == IndexRange{.first = 4, .count = 1});
}

TEST_CASE("a run on one side is one signal at its eighth point, or seventh") {
  const auto signals = [](const Values& values, RuleSet rules, const Breaks& breaks = {}) {
    return find_signals(series_of(values, breaks), unit_limits, rules);
  };
  const Values seven = joined({{2, -0.5}, {7, 0.5}, {1, -0.5}});
  CHECK(signals(seven, RuleSet::standard).empty());
  REQUIRE(signals(seven, RuleSet::atlas).size() == 1);
  CHECK(signals(seven, RuleSet::atlas)[0].index == 8);

  const auto run = signals(joined({{2, 0.5}, {12, -0.5}}), RuleSet::standard);
  REQUIRE(run.size() == 1);
  CHECK(run[0].rule == Rule::one_side);
  CHECK(run[0].side == Side::lower);
  CHECK(run[0].index == 9);
  CHECK(run[0].points == IndexRange{.first = 2, .count = 12});

  CHECK(signals(joined({{7, 0.5}, {1, 0.0}, {7, 0.5}}), RuleSet::standard).empty());
  CHECK(signals(joined({{14, 0.5}}), RuleSet::standard, {7}).empty());
  CHECK(signals(joined({{15, 0.5}}), RuleSet::standard, {7}).size() == 1);
}

TEST_CASE("two of three and four of five are signals on request") {
  const auto count = [](const Values& values, Rule rule, const Breaks& breaks = {}) {
    std::vector<std::size_t> indices;
    const Series series = series_of(values, breaks);
    for (const Signal& signal : find_signals(series, unit_limits, RuleSet::western_electric)) {
      if (signal.rule == rule) indices.push_back(signal.index);
    }
    for (const Signal& signal : find_signals(series, unit_limits, RuleSet::standard)) {
      CHECK(signal.rule != rule);
    }
    return indices;
  };
  using Indices = std::vector<std::size_t>;
  CHECK(count({0, 2.1, 2.1, 0, 0}, Rule::two_of_three) == Indices{2});
  CHECK(count({2.1, 0, 2.1, 0, 2.1}, Rule::two_of_three) == Indices{2, 4});
  CHECK(count({2.1, 0, 0, 2.1}, Rule::two_of_three).empty());
  CHECK(count({2.1, 0, -2.1}, Rule::two_of_three).empty());
  CHECK(count({2.0, 0, 2.1}, Rule::two_of_three).empty());
  CHECK(count({2.1, 2.1}, Rule::two_of_three, {1}).empty());
  CHECK(count({-2.1, -2.1}, Rule::two_of_three) == Indices{1});
  CHECK(count({1.1, 1.1, 0, 1.1, 1.1}, Rule::four_of_five) == Indices{4});
  CHECK(count({1.1, 1.1, 0, 1.1, 0, 1.1}, Rule::four_of_five).empty());
  CHECK(count({1.1, 1.1, 1.1, 1.1, 0}, Rule::four_of_five) == Indices{3});
  CHECK(count({1.1, 1.1, 1.1, 1.1}, Rule::four_of_five, {2}).empty());
}

TEST_CASE("runs that a few points part are one period of a shifted mean") {
  const auto periods = [](const Values& values) {
    const auto signals = find_signals(series_of(values), unit_limits, RuleSet::standard);
    return shifted_periods(signals, RuleSet::standard);
  };
  const auto one = periods(joined({{3, -0.5}, {9, 0.5}, {7, -0.5}, {10, 0.5}, {3, -0.5}}));
  REQUIRE(one.size() == 1);
  CHECK(one[0].side == Side::upper);
  CHECK(one[0].points == IndexRange{.first = 3, .count = 26});
  const Values close = appended(joined({{9, 0.5}, {3, -0.5}, {1, 0.5}, {3, -0.5}}), Values(9, 0.5));
  CHECK(periods(close).size() == 1);
  const Values apart = appended(joined({{9, 0.5}, {4, -0.5}, {1, 0.5}, {3, -0.5}}), Values(9, 0.5));
  CHECK(periods(apart).size() == 2);
  const auto three = periods(joined({{9, 0.5}, {8, -0.5}, {9, 0.5}}));
  REQUIRE(three.size() == 3);
  CHECK(three[1].side == Side::lower);
}

TEST_CASE("each rule signals as often as it says that chance does") {
  constexpr std::size_t count = 400'000;
  const Values values = Normal(11).values(count);
  const Series series = series_of(values);
  for (const RuleSet rules : {RuleSet::western_electric, RuleSet::atlas}) {
    const auto signals = find_signals(series, unit_limits, rules);
    const Stability stability = judge(signals, unit_limits, rules, {.points = count});
    CHECK(stability.counts.size() == (rules == RuleSet::atlas ? 2 : 4));
    for (const RuleCount& row : stability.counts) {
      CAPTURE(static_cast<int>(row.rule));
      CHECK(static_cast<double>(row.signals) == Approx(row.expected).epsilon(0.06));
    }
    CHECK(stability.verdict == Verdict::stable);
  }
}

TEST_CASE("the quantile of Poisson is exact") {
  struct Case {
    double mean;
    std::size_t quantile;  ///< scipy.stats.poisson.ppf(0.95, mean)
  };
  for (const auto& [mean, quantile] :
       {Case{0, 0}, Case{0.05, 0}, Case{0.06, 1}, Case{50.0 / 370, 1}, Case{3, 6},
        Case{1200.0 / 256, 8}, Case{1e5 / 370, 298}, Case{1e6 / 256, 4009}}) {
    CAPTURE(mean);
    CHECK(poisson_95(mean) == quantile);
  }
}

TEST_CASE("an error of the limits allows more signals, and the more the smaller the baseline") {
  const Surroundings all = {.points = 1200};
  const auto allowed = [&](std::size_t baseline, LimitsFrom from,
                           ChartKind kind = ChartKind::individuals) {
    ControlLimits limits = unit_limits;
    limits.kind = kind;
    limits.points = baseline;
    limits.from = from;
    const Stability stability = judge({}, limits, RuleSet::standard, all);
    return *stability.counts[0].allowed;
  };
  CHECK(allowed(1200, LimitsFrom::this_series) == poisson_95(1200 / 370.0));
  CHECK(allowed(1200, LimitsFrom::another_series) >= poisson_95(1200 / 370.0));
  CHECK(allowed(125, LimitsFrom::this_series) > poisson_95(1200 / 370.0));
  CHECK(allowed(25, LimitsFrom::this_series) > allowed(125, LimitsFrom::this_series));
  // Of each point of 25 in a chart of subgroups, sigma is known from 5 values.
  CHECK(allowed(25, LimitsFrom::this_series, ChartKind::subgroups) <
        allowed(25, LimitsFrom::this_series));
}

namespace {

constexpr int windows_of_each = 400;

/// How many of 400 series of independent normal values are called unstable, after `disturb`.
template <typename Disturb>
int called_unstable(std::size_t count, const AssessmentOptions& options, const Disturb& disturb) {
  Normal normal(count);
  int unstable = 0;
  for (int window = 0; window < windows_of_each; ++window) {
    Values values = normal.values(count);
    disturb(values);
    const auto chart = assess(series_of(values), {}, options).chart;
    REQUIRE(chart);
    unstable += chart->stability.verdict == Verdict::unstable ? 1 : 0;
  }
  return unstable;
}

}  // namespace

TEST_CASE("stable processes are called unstable in less than a tenth of all windows") {
  const auto leave = [](const Values&) {};
  const IndexRange least = {.first = 0, .count = 25};
  for (const AssessmentOptions& options :
       {AssessmentOptions{}, AssessmentOptions{.rules = RuleSet::atlas},
        AssessmentOptions{.baseline = least}}) {
    for (const std::size_t count : {50U, 125U, 500U, 1200U}) {
      CAPTURE(count);
      CAPTURE(static_cast<int>(options.rules));
      CAPTURE(options.baseline.has_value());
      CHECK(called_unstable(count, options, leave) <= windows_of_each / 10);
    }
  }
}

TEST_CASE("rounding makes no stable process unstable") {
  // Of 0.01; sigma is 1.5 and 3 steps, and the mean lies where one side has more steps.
  for (const double deviation : {0.015, 0.03}) {
    for (const std::size_t count : {125U, 1200U, 2000U, 2500U}) {
      CAPTURE(deviation);
      CAPTURE(count);
      const auto round = [&](Values& values) {
        for (double& value : values) value = std::round(271.2 + value * deviation * 100) / 100;
      };
      CHECK(called_unstable(count, {}, round) <= windows_of_each / 10);
      const auto shift = [&](Values& values) {
        for (std::size_t at = values.size() / 2; at < values.size(); ++at) values[at] += 1.5;
        round(values);
      };
      if (count > 1000) CHECK(called_unstable(count, {}, shift) >= windows_of_each * 99 / 100);
    }
  }
}

TEST_CASE("only what rounding brings is excused") {
  const auto allowed = [](double centre, double step) {
    ControlLimits limits = unit_limits;
    limits.centre = centre;
    limits.lower += centre;
    limits.upper += centre;
    const Stability stability =
        judge({}, limits, RuleSet::standard, {.points = 10'000, .step = step});
    return std::pair(*stability.counts[0].allowed, *stability.counts[1].allowed);
  };
  const auto exact = allowed(0, 0);
  CHECK(exact == std::pair(poisson_95(10'000 / 370.0), poisson_95(10'000 / 256.0)));
  CHECK(allowed(0, 1e-6) == exact);
  // Values lie as far from the centre and the limits on both sides.
  CHECK(allowed(0.25, 0.5) == exact);
  // What is 3.25 or more becomes 3.5 and is beyond 3.4; what is -2.75 or less becomes -3.
  const double share = normal_probability(-2.85) + normal_probability(-3.15);
  const double of_known = share / (2 * normal_probability(-3));
  CHECK(allowed(0.4, 0.5).first == poisson_95(10'000 / 370.0 * of_known));
  CHECK(allowed(0.4, 0.5).first > exact.first);
  // More below the centre than above.
  CHECK(allowed(0.1, 0.5).second > exact.second);
  CHECK(allowed(0.4, 0.5).second == allowed(0.1, 0.5).second);
}

TEST_CASE("a shift of the mean is found") {
  struct Case {
    std::size_t count;
    double shift;
    int least;  ///< of 400
  };
  for (const auto& [count, shift, least] :
       {Case{125, 2, 390}, Case{500, 1, 390}, Case{1200, 1, 398}, Case{1200, -1, 398}}) {
    CAPTURE(count);
    const auto raise = [by = shift](Values& values) {
      for (std::size_t at = values.size() / 2; at < values.size(); ++at) values[at] += by;
    };
    CHECK(called_unstable(count, {}, raise) >= least);
  }
}

TEST_CASE("the period of a shift is told") {
  Values values = Normal(5).values(1000, 2.71, 0.03);
  for (std::size_t at = 600; at < 700; ++at) values[at] += 0.06;
  const auto chart = assess(series_of(values), {}).chart;
  REQUIRE(chart);
  CHECK(chart->stability.verdict == Verdict::unstable);
  const auto longest = std::max_element(
      chart->periods.begin(), chart->periods.end(),
      [](const Period& a, const Period& b) { return a.points.count < b.points.count; });
  REQUIRE(longest != chart->periods.end());
  CHECK(longest->side == Side::upper);
  CHECK(longest->points.first >= 575);
  CHECK(longest->points.first <= 602);
  CHECK(longest->points.end() >= 698);
  CHECK(longest->points.end() <= 725);
}

TEST_CASE("rules are greyed when neighbours depend on each other, and stable is not said") {
  Normal normal(9);
  Values values = {0};
  while (values.size() < 300) values.push_back(0.5 * values.back() + normal.next());
  const auto chart = assess(series_of(values), {}).chart;
  REQUIRE(chart);
  CHECK(*chart->stability.autocorrelation > 0.2);
  CHECK(chart->stability.is_greyed);
  CHECK(chart->stability.verdict != Verdict::stable);
  const Stability calm =
      judge({}, unit_limits, RuleSet::standard, {.points = 300, .autocorrelation = 0.21});
  CHECK(calm.verdict == Verdict::not_judged);
  CHECK(
      judge({}, unit_limits, RuleSet::standard, {.points = 300, .autocorrelation = 0.2}).verdict ==
      Verdict::stable);
}

TEST_CASE("more than 2,000 values are charted as subgroups") {
  const Values values = Normal(13).values(2005);
  const auto few = assess(series_of(values).part({0, 2000}), {}).chart;
  REQUIRE(few);
  CHECK(few->limits.kind == ChartKind::individuals);
  const auto many = assess(series_of(values, {3}), {}).chart;
  REQUIRE(many);
  CHECK(many->limits.kind == ChartKind::subgroups);
  CHECK(many->subgroups.size() == 400);
  CHECK(many->subgroups.left_over == 5);
  CHECK(many->values_of({.first = 0, .count = 2}) == IndexRange{.first = 3, .count = 10});
  CHECK(few->values_of({.first = 4, .count = 2}) == IndexRange{.first = 4, .count = 2});
}

// ---- capability ----

namespace {

/// Values whose mean is 0 and whose s is 1.
Values standardised(std::size_t count) {
  Values values = Normal(count).values(count);
  const Moments moments = moments_of(values);
  for (double& value : values) value = (value - *moments.mean()) / *moments.deviation();
  return values;
}

Indices performance_of(const Values& values, const Specification& specification) {
  return performance(moments_of(values), specification);
}

const Stability stable = {.verdict = Verdict::stable};

}  // namespace

TEST_CASE("indices and their bounds by the formulas") {
  // Interval widths for 1.33, as in the specification.
  struct Case {
    std::size_t count;
    double low;
    double high;
  };
  for (const auto& [count, low, high] :
       {Case{50, 1.05, 1.61}, Case{125, 1.15, 1.51}, Case{500, 1.24, 1.42}}) {
    CAPTURE(count);
    const Indices found = performance_of(standardised(count), {.lower = -3.99, .upper = 6});
    REQUIRE(found.index);
    CHECK(found.count == count);
    CHECK(found.index->name == IndexName::ppk);
    CHECK(found.index->value == Approx(1.33).epsilon(1e-12));
    CHECK(std::abs(found.index->low - low) < 0.006);
    CHECK(std::abs(found.index->high - high) < 0.006);
    CHECK(*found.centred == Approx(9.99 / 6).epsilon(1e-12));
    const auto n = static_cast<double>(count);
    const double swing = 1.959963984540054 * std::sqrt(1 / (9 * n) + 1.33 * 1.33 / (2 * (n - 1)));
    CHECK(found.index->high == Approx(1.33 + swing).epsilon(1e-12));
    CHECK(found.index->low == Approx(1.33 - swing).epsilon(1e-12));
  }
}

TEST_CASE("the amount of values is told") {
  const std::pair<std::size_t, Amount> rows[] = {
      {0, Amount::too_few}, {29, Amount::too_few}, {30, Amount::few},  {49, Amount::few},
      {50, Amount::enough}, {124, Amount::enough}, {125, Amount::full}};
  for (const auto& [count, amount] : rows) CHECK(amount_of(count) == amount);
}

TEST_CASE("a specification that is none gives no index") {
  for (const Specification& specification :
       {Specification{}, Specification{.lower = 1, .upper = 1},
        Specification{.lower = 2, .upper = 1}, Specification{.lower = no_number, .upper = 1},
        Specification{.lower = {}, .upper = infinity}}) {
    CHECK_FALSE(specification.is_usable());
    const Indices found = performance_of(standardised(50), specification);
    CHECK_FALSE(found.index);
    CHECK_FALSE(found.centred);
  }
}

TEST_CASE("percentiles judge a skewed distribution otherwise than a normal one") {
  Values values = Normal(17).values(5000);
  const Specification specification{.lower = -5, .upper = 5};
  const auto normal = percentile_performance(series_of(values), specification,
                                             performance_of(values, specification));
  REQUIRE(normal);
  CHECK(normal->name == IndexName::ppk);
  CHECK_FALSE(normal->differs);
  for (double& value : values) value = std::exp(value / 2);
  const Indices of_normal = performance_of(values, {.lower = {}, .upper = 4});
  const auto skewed =
      percentile_performance(series_of(values), {.lower = {}, .upper = 4}, of_normal);
  REQUIRE(skewed);
  CHECK(skewed->name == IndexName::ppu);
  CHECK(skewed->differs);
  CHECK(skewed->value < of_normal.index->value);
  const Values few(values.begin(), values.begin() + 999);
  CHECK_FALSE(
      percentile_performance(series_of(few), specification, performance_of(few, specification)));
}

TEST_CASE("a machine study needs 50 values in one uninterrupted run") {
  const Values values = standardised(120);
  const Specification specification{.lower = -5, .upper = 5};
  CHECK_FALSE(machine_run(series_of(values, {40, 80})));
  CHECK_FALSE(machine_performance(series_of(values, {40, 80}), specification));
  CHECK(machine_run(series_of(values, {10, 60})) == IndexRange{.first = 60, .count = 60});
  CHECK(machine_run(series_of(values, {60})) == IndexRange{.first = 60, .count = 60});
  CHECK(machine_run(series_of(values).part({0, 50})));
  CHECK_FALSE(machine_run(series_of(values).part({0, 49})));
  const auto found = machine_performance(series_of(values, {51}), specification);
  REQUIRE(found);
  CHECK(found->count == 69);
  CHECK(found->index->name == IndexName::cmk);
  CHECK(to_text(found->index->name) == "Cmk");
}

TEST_CASE("normality by Anderson and Darling") {
  const auto of = [](const Values& values) { return normality(series_of(values)); };
  const auto small = of(flow_rate);
  REQUIRE(small);
  CHECK(small->statistic == Approx(0.3048580492709476).epsilon(1e-10));
  CHECK(small->probability == Approx(0.5078618436094889).epsilon(1e-10));
  Values squares(200);
  for (std::size_t at = 0; at < 200; ++at) squares[at] = static_cast<double>(at * at);
  CHECK(of(squares)->statistic == Approx(6.756430660919392).epsilon(1e-10));
  CHECK(of(squares)->probability == Approx(1.3117161582223455e-16).epsilon(1e-8));
  // A tail of 70 sigma, whose probability is no number of a computer.
  const auto outlier = of(joined({{4999, 0.0}, {1, 1.0}}));
  REQUIRE(outlier);
  CHECK(std::isfinite(outlier->statistic));
  CHECK(outlier->probability == 0);
  CHECK(of(quiet(8)));
  CHECK_FALSE(of(quiet(7)));
  CHECK(of(quiet(5000)));
  CHECK_FALSE(of(quiet(5001)));
  CHECK_FALSE(of(Values(100, 1.0)));
}

// ---- counts and classes ----

TEST_CASE("yield has Wilson's interval") {
  const auto day = yield_of(1187, 17);
  REQUIRE(day);
  CHECK(day->share == Approx(1187.0 / 1204));
  CHECK(day->low == Approx(0.9775042491510493).epsilon(1e-12));
  CHECK(day->high == Approx(0.991165928094198).epsilon(1e-12));
  CHECK(yield_of(50, 0)->low == Approx(0.9286524008666412).epsilon(1e-12));
  CHECK(yield_of(50, 0)->high == 1);
  CHECK(yield_of(0, 50)->low == 0);
  CHECK(yield_of(0, 50)->high == Approx(1 - 0.9286524008666412).epsilon(1e-12));
  CHECK_FALSE(yield_of(0, 0));
}

TEST_CASE("Pareto is ordered by count and adds up to 100 %") {
  const std::vector<KeyCount> counts = {
      {"E330", 2}, {"E300", 0}, {"E333", 11}, {"E336", 2}, {"E335", 3}};
  const auto rows = pareto(counts);
  REQUIRE(rows.size() == 4);
  CHECK(rows[0].key == "E333");
  CHECK(rows[1].key == "E335");
  CHECK(rows[2].key == "E330");
  CHECK(rows[3].key == "E336");
  CHECK(rows[0].percent == Approx(1100.0 / 18));
  CHECK(rows[1].cumulated == Approx(1400.0 / 18));
  CHECK(rows[3].cumulated == 100);
  std::vector<KeyCount> equal;
  for (char key = 'A'; key <= 'Z'; ++key) equal.push_back({.key = std::string(1, key), .count = 3});
  const auto ties = pareto(equal);
  for (std::size_t at = 0; at < equal.size(); ++at) CHECK(ties[at].key == equal[at].key);
  CHECK(pareto({}).empty());
  CHECK(pareto(std::vector<KeyCount>{{"E300", 0}}).empty());
}

TEST_CASE("a histogram counts every value once") {
  const Values values = Normal(19).values(10'000, 2.71, 0.03);
  const auto found = histogram(series_of(values));
  REQUIRE(found);
  std::size_t sum = 0;
  for (const std::size_t count : found->counts) sum += count;
  CHECK(sum == values.size());
  CHECK(found->counts.size() >= 10);
  CHECK(found->counts.size() <= 100);
  CHECK(found->counts.front() > 0);
  CHECK(found->counts.back() > 0);
  const auto [lowest, highest] = std::minmax_element(values.begin(), values.end());
  CHECK(found->edge(0) <= *lowest);
  CHECK(found->edge(found->counts.size()) >= *highest);
  // 2 IQR / n^(1/3) is 0.00376.
  CHECK(found->steps == 1);
  CHECK(histogram(series_of(values), 0.001)->steps == 4);
}

TEST_CASE("a histogram of one outlier keeps to its most classes") {
  Values values = Normal(23).values(1000, 2.71, 0.03);
  values.push_back(1e6);
  const auto found = histogram(series_of(values), 0.01, 20);
  REQUIRE(found);
  CHECK(found->counts.size() <= 20);
  CHECK(found->counts.back() == 1);
}

TEST_CASE("a histogram is nothing where steps cannot be told apart") {
  CHECK_FALSE(histogram(series_of({})));
  CHECK_FALSE(histogram(series_of({1e60})));
  CHECK_FALSE(histogram(series_of({1}), 0));
  CHECK_FALSE(histogram(series_of({1}), -0.01));
  CHECK_FALSE(histogram(series_of({1}), no_number));
  CHECK_FALSE(histogram(series_of({1}), infinity));
  const auto widest = histogram(series_of({-9e13, 9e13}));
  REQUIRE(widest);
  CHECK(widest->counts.size() <= usual_most_classes);
  const auto one = histogram(series_of(Values(50, 2.71)));
  REQUIRE(one);
  CHECK(one->counts == std::vector<std::size_t>{50});
  CHECK(one->edge(0) == Approx(2.705));
  CHECK(one->width() == 0.01);
}

// ---- what a quality engineer would reject ----

TEST_CASE("rejected: an index without its number of values and bounds, or from less than 30") {
  const Values values = standardised(60);
  const Specification specification{.lower = -4, .upper = 4};
  const Series series = series_of(values);
  for (const std::size_t count : {0U, 1U, 2U, 29U}) {
    CAPTURE(count);
    const Series part = series.part({0, count});
    const Indices found = performance(moments_of(part.values()), specification);
    CHECK(found.count == count);
    CHECK_FALSE(found.index);
    CHECK_FALSE(found.centred);
    CHECK_FALSE(capability(part, specification, stable)->index);
  }
  const Indices found = performance(moments_of(series.part({0, 30}).values()), specification);
  REQUIRE(found.index);
  CHECK(found.amount == Amount::few);
  CHECK(found.index->low < found.index->value);
  CHECK(found.index->value < found.index->high);
}

TEST_CASE("rejected: Cpk while there are more signals than chance explains") {
  const Specification specification{.lower = -10, .upper = 10};
  Values values = Normal(29).values(600);
  const Assessment calm = assess(series_of(values), specification);
  REQUIRE(calm.chart);
  REQUIRE(calm.chart->stability.verdict == Verdict::stable);
  REQUIRE(calm.capability);
  CHECK(calm.capability->index->name == IndexName::cpk);
  for (std::size_t at = 300; at < 600; ++at) values[at] += 2;
  const Assessment shifted = assess(series_of(values), specification);
  CHECK(shifted.chart->stability.verdict == Verdict::unstable);
  CHECK_FALSE(shifted.capability);
  CHECK(shifted.performance.index);
  for (const Verdict verdict : {Verdict::unstable, Verdict::not_judged}) {
    CHECK_FALSE(capability(series_of(values), specification, {.verdict = verdict}));
  }
  // Without control limits, nothing says that it is stable.
  const Assessment few = assess(series_of(values).part({0, 24}), specification);
  CHECK_FALSE(few.chart);
  CHECK_FALSE(few.capability);
}

TEST_CASE("rejected: unstable because of one signal in ten thousand points") {
  Values values = Normal(31).values(10'000);
  values[7000] = 40;
  const auto chart = assess(series_of(values), {}).chart;
  REQUIRE(chart);
  CHECK(chart->stability.verdict == Verdict::stable);
  CHECK(std::any_of(chart->signals.begin(), chart->signals.end(), [&](const Signal& signal) {
    return chart->values_of(signal.points) == IndexRange{.first = 7000, .count = 5};
  }));
}

TEST_CASE("rejected: Cmk from production data") {
  const Values values = standardised(200);
  const Assessment found = assess(series_of(values), {.lower = -5, .upper = 5});
  REQUIRE(found.performance.index);
  CHECK(to_text(found.performance.index->name) == "Ppk");
  Breaks breaks;
  for (std::size_t at = 0; at < 200; at += 49) breaks.push_back(at);
  CHECK_FALSE(machine_performance(series_of(values, breaks), {.lower = -5, .upper = 5}));
}

TEST_CASE("rejected: s of all values called Cpk, sigma within called Ppk") {
  // Drifts slowly: neighbours are close, the whole is wide.
  Values values = quiet(200, 0.1);
  for (std::size_t at = 0; at < values.size(); ++at) values[at] += static_cast<double>(at) / 50;
  const Series series = series_of(values);
  const Moments moments = moments_of(values);
  const Specification specification{.lower = -1, .upper = 5};
  const auto distance = std::min(5 - *moments.mean(), *moments.mean() + 1);
  const Indices all = performance(moments, specification);
  const auto within = capability(series, specification, stable);
  CHECK(to_text(all.index->name) == "Ppk");
  CHECK(all.index->value == Approx(distance / (3 * *moments.deviation())));
  CHECK(to_text(within->index->name) == "Cpk");
  CHECK(within->index->value == Approx(distance / (3 * moving_range(series).mean / 1.128)));
  CHECK(within->index->value > 3 * all.index->value);
  const double freedom = 0.62 * 199;
  const double value = within->index->value;
  CHECK(value - within->index->low ==
        Approx(1.96 * std::sqrt(1.0 / (9 * 200) + value * value / (2 * freedom))).epsilon(1e-4));
}

TEST_CASE("rejected: control limits from the specification") {
  const Values values = Normal(37).values(200);
  const auto narrow = assess(series_of(values), {.lower = -0.1, .upper = 0.1}).chart;
  const auto wide = assess(series_of(values), {.lower = -100, .upper = 100}).chart;
  REQUIRE(narrow);
  REQUIRE(wide);
  CHECK(narrow->limits.upper == wide->limits.upper);
  CHECK(narrow->limits.lower == wide->limits.lower);
  CHECK(narrow->signals.size() == wide->signals.size());
}

TEST_CASE("rejected: control limits that move so that today's shift disappears") {
  const Values yesterday = Normal(41).values(400);
  const auto before = assess(series_of(yesterday), {}).chart;
  REQUIRE(before);
  CHECK(before->limits.baseline == IndexRange{.first = 0, .count = 125});

  const Values today = Normal(43).values(100, 2);
  const auto both = assess(series_of(appended(yesterday, today)), {}).chart;
  REQUIRE(both);
  CHECK(both->limits.upper == before->limits.upper);
  CHECK(both->limits.lower == before->limits.lower);
  CHECK(both->stability.verdict == Verdict::unstable);

  CHECK(assess(series_of(today), {}).chart->stability.verdict == Verdict::stable);
  const auto frozen = assess(series_of(today), {}, {.frozen = before->limits}).chart;
  REQUIRE(frozen);
  CHECK(frozen->limits.from == LimitsFrom::another_series);
  CHECK(frozen->limits.upper == before->limits.upper);
  CHECK(frozen->stability.verdict == Verdict::unstable);
}

TEST_CASE("rejected: a two-sided index where only one limit exists") {
  const Values values = standardised(100);
  const Indices upper = performance_of(values, {.lower = {}, .upper = 6});
  CHECK_FALSE(upper.centred);
  CHECK(to_text(upper.index->name) == "Ppu");
  CHECK(upper.index->value == Approx(2));
  const Indices lower = performance_of(values, {.lower = -3, .upper = {}});
  CHECK_FALSE(lower.centred);
  CHECK(to_text(lower.index->name) == "Ppl");
  CHECK(lower.index->value == Approx(1));
  const auto within = capability(series_of(values), {.lower = {}, .upper = 6}, stable);
  CHECK(to_text(within->index->name) == "Cpu");
  CHECK_FALSE(within->centred);
  const auto below = capability(series_of(values), {.lower = -3, .upper = {}}, stable);
  CHECK(to_text(below->index->name) == "Cpl");
}

TEST_CASE("rejected: a moving range across a pause, a gap or a change of the tool") {
  const Values values = appended(quiet(50), appended(Values{}, quiet(50, 0.5)));
  Values shifted = values;
  for (std::size_t at = 50; at < 100; ++at) shifted[at] += 1000;
  const MovingRange parted = moving_range(series_of(shifted, {50}));
  CHECK(parted.ranges == 98);
  CHECK(parted.mean == Approx(moving_range(series_of(values, {50})).mean));
  CHECK(moving_range(series_of(shifted)).mean > 10);
}

TEST_CASE("rejected: ppm from a tail that was fitted") {
  // By a normal tail, values close to a limit would be hundreds of ppm.
  CHECK(yield_of(50, 0)->ng_ppm == 0);
  CHECK(yield_of(1187, 17)->ng_ppm == Approx(17e6 / 1204));
}

TEST_CASE("rejected: rounded values without a remark about the resolution") {
  const auto rounded = [](double deviation) {
    Values values = Normal(47).values(500, 0.15, deviation);
    for (double& value : values) value = std::round(value * 100) / 100;
    return values;
  };
  const Specification specification{.lower = 0.1, .upper = 0.2};
  const Assessment coarse = assess(series_of(rounded(0.006)), specification);
  CHECK(coarse.is_too_coarse);
  CHECK_FALSE(coarse.capability);
  if (coarse.chart) CHECK(coarse.chart->stability.verdict == Verdict::not_judged);
  CHECK_FALSE(assess(series_of(rounded(0.02)), specification).is_too_coarse);
  CHECK_FALSE(
      assess(series_of(rounded(0.006)), specification, {.resolution = 0.001}).is_too_coarse);
  CHECK(is_too_coarse({.ranges = 19, .mean = 0.0122}, 0.01));
  CHECK_FALSE(is_too_coarse({.ranges = 19, .mean = 0.0123}, 0.01));
  CHECK_FALSE(is_too_coarse({.ranges = 18, .mean = 0.0122}, 0.01));
}

TEST_CASE("rejected: outliers that are removed without a name") {
  Values values = Normal(53).values(100, 2.71, 0.03);
  const Specification specification{.lower = 2.44, .upper = 2.98};
  const double without = assess(series_of(values), specification).performance.index->value;
  values.push_back(1.35);
  const Assessment found = assess(series_of(values), specification);
  CHECK(found.moments.count() == 101);
  CHECK(*found.moments.min() == 1.35);
  CHECK(found.performance.index->value < without / 3);
}

TEST_CASE("rejected: a histogram whose classes are finer than the resolution, or a comb") {
  // Rounded values spread evenly over each step: no class may be empty or twice as full.
  Values values;
  for (int step = 200; step < 320; ++step) {
    for (int times = 0; times < 10; ++times) values.push_back(step * 0.01);
  }
  for (const std::size_t most : {7U, 20U, 50U, 100U, 1000U}) {
    CAPTURE(most);
    const auto found = histogram(series_of(values), 0.01, most);
    REQUIRE(found);
    CHECK(found->steps >= 1);
    CHECK(found->counts.size() <= most);
    for (std::size_t at = 0; at + 1 < found->counts.size(); ++at) {
      CHECK(found->counts[at] == static_cast<std::size_t>(10 * found->steps));
    }
  }
  // So few and so close that the rule asks for less than a step.
  const auto close = histogram(series_of(joined({{500, 2.70}, {500, 2.71}, {500, 2.72}})));
  REQUIRE(close);
  CHECK(close->counts == std::vector<std::size_t>{500, 500, 500});
}

// ---- whatever the values are ----

namespace {

void check_finite(const std::optional<double>& number) {
  if (number) CHECK(std::isfinite(*number));
}

void check_finite(const Indices& indices) {
  check_finite(indices.centred);
  if (!indices.index) return;
  for (const double number : {indices.index->value, indices.index->low, indices.index->high}) {
    CHECK(std::isfinite(number));
  }
}

void check_finite(const Assessment& found) {
  for (const auto& number :
       {found.moments.mean(), found.moments.deviation(), found.moments.skewness(),
        found.moments.excess_kurtosis(), found.within, found.autocorrelation}) {
    check_finite(number);
  }
  check_finite(found.performance);
  if (found.capability) check_finite(*found.capability);
  if (found.percentile) CHECK(std::isfinite(found.percentile->value));
  if (found.normality) {
    CHECK(std::isfinite(found.normality->statistic));
    CHECK(found.normality->probability >= 0);
    CHECK(found.normality->probability <= 1);
  }
  if (!found.chart) return;
  const ControlLimits& limits = found.chart->limits;
  for (const double number : {limits.centre, limits.lower, limits.upper, limits.spread_upper}) {
    CHECK(std::isfinite(number));
  }
}

}  // namespace

TEST_CASE("no number that is told is infinite or none") {
  const Values patterns[] = {{0, 0, 0},         {1e60, -1e60, 1e60}, {1e60, 1e60},
                             {5e-324, 0, 0},    {1e-200, 2e-200},    {2.71, 2.71, 2.71},
                             {-1, 1, -1, 1, 0}, {1e60, 0, 0, 0, 0},  {1e-300, 1e60, -1e-300}};
  const Specification specifications[] = {{},
                                          {.lower = -1e60, .upper = 1e60},
                                          {.lower = 2, .upper = {}},
                                          {.lower = {}, .upper = 5e-324}};
  for (const Values& pattern : patterns) {
    for (const std::size_t count : {0U, 1U, 2U, 3U, 24U, 25U, 30U, 126U, 1001U, 2011U}) {
      Values values;
      for (std::size_t at = 0; at < count; ++at) values.push_back(pattern[at % pattern.size()]);
      for (const Specification& specification : specifications) {
        for (const Breaks& breaks : {Breaks{}, Breaks{1, 2, 13, 1000}}) {
          CAPTURE(pattern[0]);
          CAPTURE(count);
          check_finite(assess(series_of(values, breaks), specification));
          check_finite(
              assess(series_of(values, breaks), specification,
                     {.rules = RuleSet::western_electric, .frozen = unit_limits, .resolution = 0}));
        }
      }
    }
  }
}
