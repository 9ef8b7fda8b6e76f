#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "spindle/chart/figure.hpp"

namespace spindle::chart {

struct Sample {
  std::int64_t at = 0;
  double value = 0;
  /// Drawn as a mark and never asked for the scale: one aborted rundown must not flatten the rest.
  bool is_ng = false;
  /// No line leads to it from the sample before: a pause or a restart lies between.
  bool is_first = false;
};

/// Values in their order. Above two samples a pixel column the good ones become a band from the
/// smallest to the largest, with their mean.
struct RunChart {
  Caption caption;
  Course course = {};
  Quantity quantity;
  std::vector<Sample> samples;  ///< in order of `at`
  std::vector<Level> levels = {};
  std::vector<Change> changes = {};
  std::vector<Gap> gaps = {};
};

std::string run_chart(const RunChart& chart, Format format = Format::wide);

/// The same in the height of a table row, without a scale in figures.
std::string small_run_chart(const RunChart& chart);

}  // namespace spindle::chart
