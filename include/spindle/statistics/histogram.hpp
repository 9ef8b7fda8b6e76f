#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "spindle/statistics/series.hpp"

namespace spindle::statistics {

/// Values counted in classes that each hold the same whole number of steps of the resolution, so
/// that no class has room for more different values than the next one. A value counts for the
/// nearest step.
struct Histogram {
  double resolution = 0;
  std::int64_t first_step = 0;  ///< lowest step of the first class; its value: step x resolution
  std::int64_t steps = 1;       ///< in each class
  std::vector<std::size_t> counts = {};

  double width() const;
  /// Where a class begins, half a step below its lowest step; of class counts.size(): where the
  /// last one ends.
  double edge(std::size_t index) const;
};

inline constexpr double usual_resolution = 0.01;
inline constexpr std::size_t usual_most_classes = 100;

/// The class width is that of Freedman and Diaconis (1981), 2 IQR / n^(1/3), rounded to steps,
/// never less than one, and more where there would be more than `most_classes` otherwise.
/// Nothing without values, where the resolution is not above 0, and where the values are so large
/// that a double does not tell their steps apart.
std::optional<Histogram> histogram(const Series& series, double resolution = usual_resolution,
                                   std::size_t most_classes = usual_most_classes);

}  // namespace spindle::statistics
