#pragma once

#include <cstddef>
#include <span>

namespace spindle::statistics {

/// The 97.5 % quantile of the normal distribution: two-sided bounds of 95 %.
inline constexpr double normal_95 = 1.959963984540054;

/// P(Z <= z) of the standard normal distribution.
double normal_probability(double z);

/// ln P(Z <= z), also where the probability itself is smaller than any number.
double log_normal_probability(double z);

/// P(K <= k) when `mean` events are expected.
double poisson_probability(std::size_t k, double mean);

/// A mean of events, and how likely it is the right one.
struct PoissonPart {
  double weight;
  double mean;
};

/// The smallest k that is not exceeded with a probability of 95 %. The weights add up to 1.
std::size_t poisson_95(std::span<const PoissonPart> mixture);
std::size_t poisson_95(double mean);

}  // namespace spindle::statistics
