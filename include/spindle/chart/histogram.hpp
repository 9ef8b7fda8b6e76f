#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "spindle/chart/figure.hpp"

namespace spindle::chart {

struct HistogramClass {
  std::uint64_t count = 0;  ///< with the NG ones
  std::uint64_t ng = 0;
};

struct NormalCurve {
  double mean = 0;
  double deviation = 0;
};

/// Classes of so many steps of the resolution each, from the value `first` × step on: a class never
/// cuts a step, and its edges lie half a step beside its values.
struct Histogram {
  Caption caption;
  Quantity quantity;
  double step = 0.01;
  std::int64_t first = 0;
  std::int64_t steps_per_class = 1;
  std::vector<HistogramClass> classes;
  std::uint64_t below = 0;  ///< values left of the first class
  std::uint64_t above = 0;
  std::vector<Level> levels = {};
  std::optional<NormalCurve> normal = std::nullopt;
};

std::string histogram(const Histogram& chart, Format format = Format::wide);

}  // namespace spindle::chart
