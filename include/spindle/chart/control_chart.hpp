#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "spindle/chart/figure.hpp"

namespace spindle::chart {

struct ControlPoint {
  std::int64_t at = 0;
  double value = 0;
  /// The rule that it breaks (1 to 9), 0 for none.
  int signal = 0;
  /// No line leads to it: a new run begins.
  bool is_first = false;
};

/// Centre line and control limits are levels.
struct ControlPanel {
  Quantity quantity;
  std::vector<ControlPoint> points;  ///< in order of `at`
  std::vector<Level> levels = {};
};

/// What the limits were computed from.
struct Baseline {
  std::int64_t from = 0;
  std::int64_t to = 0;
  std::string word = "baseline";
};

struct ControlChart {
  Caption caption;
  Course course = {};
  ControlPanel values;
  std::optional<ControlPanel> variation = std::nullopt;  ///< moving ranges or S, below
  std::optional<Baseline> baseline = std::nullopt;
  std::vector<Change> changes = {};
  std::vector<Gap> gaps = {};
  /// Why the signals prove little (autocorrelation, a coarse resolution): they are drawn grey and
  /// this is said.
  std::string doubt = {};
};

std::string control_chart(const ControlChart& chart, Format format = Format::wide);

}  // namespace spindle::chart
