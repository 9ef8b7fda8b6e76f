#pragma once

#include <cstddef>
#include <optional>
#include <span>

namespace spindle::statistics {

/// Count, mean, spread and shape of values that come one by one (Welford 1962; third and fourth
/// moments and merge() after Pébay, SAND2008-6212). What is not a finite number is not taken in.
class Moments {
 public:
  void add(double value);
  /// As if the values of the other had been added too.
  void merge(const Moments& other);

  std::size_t count() const { return count_; }
  /// Nothing without a value, as min() and max().
  std::optional<double> mean() const;
  std::optional<double> min() const;
  std::optional<double> max() const;
  /// s with n - 1. Nothing below 2 values; 0 when all are equal.
  std::optional<double> deviation() const;
  /// m3 / m2^1.5, with moments over n (scipy.stats.skew with bias=True). Nothing when all values
  /// are equal.
  std::optional<double> skewness() const;
  /// m4 / m2^2 - 3, so that a normal distribution has 0 (scipy.stats.kurtosis with bias=True).
  /// Nothing when all values are equal.
  std::optional<double> excess_kurtosis() const;

 private:
  std::size_t count_ = 0;
  double mean_ = 0;
  double square_ = 0;  ///< sum of the squared distances from the mean
  double cube_ = 0;
  double fourth_ = 0;
  double min_ = 0;
  double max_ = 0;
};

Moments moments_of(std::span<const double> values);

}  // namespace spindle::statistics
