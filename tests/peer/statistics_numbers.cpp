// Prints the statistics of the numbers that it reads, one name and its values a line; arguments are
// the indices before which their order is interrupted. Another program judges them.
#include <cstdio>
#include <cstdlib>
#include <initializer_list>
#include <limits>
#include <optional>
#include <vector>

#include "spindle/statistics/assessment.hpp"
#include "spindle/statistics/counts.hpp"
#include "statistics/distributions.hpp"

namespace {

using namespace spindle::statistics;

constexpr Specification both = {.lower = 2.44, .upper = 2.98};
constexpr Specification upper_only = {.lower = {}, .upper = 2.98};

void print(const char* name, std::initializer_list<std::optional<double>> values) {
  std::printf("%s", name);
  for (const auto& value : values) {
    std::printf(" %.17g", value.value_or(std::numeric_limits<double>::quiet_NaN()));
  }
  std::printf("\n");
}

void print(const char* name, const Indices& indices) {
  if (!indices.index) return;
  print(name, {indices.index->value, indices.index->low, indices.index->high, indices.centred});
}

void print(const ControlLimits& limits) {
  print("limits", {limits.centre, limits.lower, limits.upper});
  print("spread", {limits.spread_centre, limits.spread_lower, limits.spread_upper});
  print("baseline",
        {static_cast<double>(limits.baseline.first), static_cast<double>(limits.baseline.count)});
}

void print(const Stability& stability) {
  for (const RuleCount& row : stability.counts) {
    print("rule", {static_cast<double>(row.rule), static_cast<double>(row.signals), row.expected});
  }
}

void print(const Histogram& classes) {
  print("classes", {classes.edge(0), classes.width()});
  std::printf("counts");
  for (const std::size_t count : classes.counts) std::printf(" %zu", count);
  std::printf("\n");
}

/// What depends on no values.
void print_tables() {
  for (double mean = 0.01; mean < 5000; mean *= 1.3) {
    print("poisson", {mean, static_cast<double>(poisson_95(mean))});
  }
  for (const std::size_t ok : {0U, 1U, 7U, 1187U, 1'000'000U}) {
    for (const std::size_t ng : {1U, 17U, 5000U}) {
      const auto yield = yield_of(ok, ng);
      print("yield", {static_cast<double>(ok), static_cast<double>(ng), yield->low, yield->high});
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<double> values;
  for (double value = 0; std::scanf("%lf", &value) == 1;) values.push_back(value);
  std::vector<std::size_t> breaks;
  for (int at = 1; at < argc; ++at) breaks.push_back(std::strtoul(argv[at], nullptr, 10));
  const auto series = Series::of(values, breaks);
  if (!series) return 1;

  const Assessment found = assess(*series, both, {.rules = RuleSet::western_electric});
  print("moments", {found.moments.mean(), found.moments.deviation(), found.moments.skewness(),
                    found.moments.excess_kurtosis(), found.moments.min(), found.moments.max()});
  print("ranges", {moving_range(*series).mean, found.within});
  print("autocorrelation", {found.autocorrelation});
  print("performance", found.performance);
  print("upper_performance", performance(found.moments, upper_only));
  print("capability", *capability(*series, both, {.verdict = Verdict::stable}));
  if (found.percentile) print("percentile", {found.percentile->value});
  if (found.normality) {
    print("normality", {found.normality->statistic, found.normality->probability});
  }
  if (found.chart) {
    print(found.chart->limits);
    print(found.chart->stability);
  }
  if (const auto classes = histogram(*series)) print(*classes);
  print_tables();
  return 0;
}
