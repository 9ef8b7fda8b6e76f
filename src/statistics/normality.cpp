#include "spindle/statistics/normality.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "spindle/statistics/moments.hpp"
#include "statistics/distributions.hpp"

namespace spindle::statistics {
namespace {

constexpr std::size_t least = 8;
constexpr std::size_t most = 5000;

double probability_of(double a) {
  // Beyond it the approximation rises again.
  constexpr double nothing_beyond = 13;
  if (a < 0.2) return 1 - std::exp(-13.436 + 101.14 * a - 223.73 * a * a);
  if (a < 0.34) return 1 - std::exp(-8.318 + 42.796 * a - 59.938 * a * a);
  if (a < 0.6) return std::exp(0.9177 - 4.279 * a - 1.38 * a * a);
  if (a <= nothing_beyond) return std::exp(1.2937 - 5.709 * a + 0.0186 * a * a);
  return 0;
}

}  // namespace

std::optional<Normality> normality(const Series& series) {
  if (series.size() < least || series.size() > most) return std::nullopt;
  const Moments moments = moments_of(series.values());
  const double mean = moments.mean().value_or(0);
  const double s = moments.deviation().value_or(0);
  if (s <= 0) return std::nullopt;
  std::vector<double> z(series.values().begin(), series.values().end());
  for (double& value : z) value = (value - mean) / s;
  std::sort(z.begin(), z.end());
  const auto n = static_cast<double>(z.size());
  double sum = 0;
  for (std::size_t at = 0; at < z.size(); ++at) {
    const double weight = 2 * static_cast<double>(at) + 1;
    sum += weight * (log_normal_probability(z[at]) + log_normal_probability(-z[z.size() - 1 - at]));
  }
  const double statistic = -n - sum / n;
  return Normality{.statistic = statistic,
                   .probability = probability_of(statistic * (1 + 0.75 / n + 2.25 / (n * n)))};
}

}  // namespace spindle::statistics
