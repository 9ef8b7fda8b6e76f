#include "spindle/statistics/moments.hpp"

#include <algorithm>
#include <cmath>

namespace spindle::statistics {
namespace {

std::optional<double> if_finite(double value) {
  if (!std::isfinite(value)) return std::nullopt;
  return value;
}

}  // namespace

void Moments::add(double value) {
  if (!std::isfinite(value)) return;
  min_ = count_ == 0 ? value : std::min(min_, value);
  max_ = count_ == 0 ? value : std::max(max_, value);
  const auto before = static_cast<double>(count_);
  const double n = before + 1;
  const double distance = value - mean_;
  const double step = distance / n;
  const double term = distance * step * before;
  mean_ += step;
  fourth_ +=
      term * step * step * (n * n - 3 * n + 3) + 6 * step * step * square_ - 4 * step * cube_;
  cube_ += term * step * (n - 2) - 3 * step * square_;
  square_ += term;
  ++count_;
}

void Moments::merge(const Moments& other) {
  if (other.count_ == 0) return;
  if (count_ == 0) {
    *this = other;
    return;
  }
  const auto a = static_cast<double>(count_);
  const auto b = static_cast<double>(other.count_);
  const double n = a + b;
  const double d = other.mean_ - mean_;
  fourth_ += other.fourth_ + d * d * d * d * a * b * (a * a - a * b + b * b) / (n * n * n) +
             6 * d * d * (a * a * other.square_ + b * b * square_) / (n * n) +
             4 * d * (a * other.cube_ - b * cube_) / n;
  cube_ += other.cube_ + d * d * d * a * b * (a - b) / (n * n) +
           3 * d * (a * other.square_ - b * square_) / n;
  square_ += other.square_ + d * d * a * b / n;
  mean_ += d * b / n;
  min_ = std::min(min_, other.min_);
  max_ = std::max(max_, other.max_);
  count_ += other.count_;
}

std::optional<double> Moments::mean() const {
  if (count_ == 0) return std::nullopt;
  return if_finite(mean_);
}

std::optional<double> Moments::min() const {
  if (count_ == 0) return std::nullopt;
  return min_;
}

std::optional<double> Moments::max() const {
  if (count_ == 0) return std::nullopt;
  return max_;
}

std::optional<double> Moments::deviation() const {
  if (count_ < 2) return std::nullopt;
  return if_finite(std::sqrt(square_ / static_cast<double>(count_ - 1)));
}

std::optional<double> Moments::skewness() const {
  const auto n = static_cast<double>(count_);
  return if_finite(std::sqrt(n) * cube_ / (square_ * std::sqrt(square_)));
}

std::optional<double> Moments::excess_kurtosis() const {
  const auto n = static_cast<double>(count_);
  return if_finite(n * fourth_ / (square_ * square_) - 3);
}

Moments moments_of(std::span<const double> values) {
  Moments moments;
  for (const double value : values) moments.add(value);
  return moments;
}

}  // namespace spindle::statistics
