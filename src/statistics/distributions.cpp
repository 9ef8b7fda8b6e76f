#include "statistics/distributions.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace spindle::statistics {

double normal_probability(double z) { return std::erfc(-z / std::numbers::sqrt2) / 2; }

double log_normal_probability(double z) {
  constexpr double asymptotic = -30;
  if (z > asymptotic) return std::log(normal_probability(z));
  const double square = z * z;
  return -square / 2 - std::log(-z) - std::log(2 * std::numbers::pi) / 2 +
         std::log1p(-1 / square + 3 / (square * square));
}

double poisson_probability(std::size_t k, double mean) {
  if (mean <= 0) return 1;
  // What lies further below the mean adds less than the rounding of a double.
  const double lowest = std::max(0.0, std::floor(mean - 12 * std::sqrt(mean) - 30));
  const auto from = static_cast<std::size_t>(lowest);
  if (k < from) return 0;
  double term = std::exp(lowest * std::log(mean) - mean - std::lgamma(lowest + 1));
  double sum = term;
  for (std::size_t at = from + 1; at <= k; ++at) {
    term *= mean / static_cast<double>(at);
    sum += term;
    const bool is_past = static_cast<double>(at) > mean && term < sum * 1e-18;
    if (is_past) break;
  }
  return std::min(sum, 1.0);
}

std::size_t poisson_95(std::span<const PoissonPart> mixture) {
  const auto probability = [&](std::size_t k) {
    double sum = 0;
    for (const auto& [weight, mean] : mixture) sum += weight * poisson_probability(k, mean);
    return sum;
  };
  constexpr double wanted = 0.95;
  std::size_t enough = 1;
  while (probability(enough) < wanted) enough *= 2;
  std::size_t from = 0;
  while (from < enough) {
    const std::size_t middle = from + (enough - from) / 2;
    if (probability(middle) < wanted) {
      from = middle + 1;
    } else {
      enough = middle;
    }
  }
  return enough;
}

std::size_t poisson_95(double mean) {
  const PoissonPart only{.weight = 1, .mean = mean};
  return poisson_95(std::span(&only, 1));
}

}  // namespace spindle::statistics
