#pragma once

#include <cstddef>
#include <optional>

#include "spindle/statistics/series.hpp"

namespace spindle::statistics {

/// Anderson-Darling test of a normal distribution whose mean and deviation are estimated from the
/// same values.
struct Normality {
  double statistic = 0;    ///< A^2
  double probability = 0;  ///< of a larger one if the distribution is normal
};

/// p by A^2 (1 + 0.75 / n + 2.25 / n^2) and the approximation of D'Agostino and Stephens (1986,
/// table 4.9). Nothing below 8 values, above 5,000, where every real distribution is rejected
/// (skewness and kurtosis of Moments say more), and when all are equal.
std::optional<Normality> normality(const Series& series);

}  // namespace spindle::statistics
