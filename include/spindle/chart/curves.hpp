#pragma once

#include <string>
#include <vector>

#include "spindle/chart/figure.hpp"

namespace spindle::chart {

struct CurvePoint {
  double x = 0;
  double y = 0;
};

struct Curve {
  std::string name;  ///< stands beside an NG one
  std::vector<CurvePoint> points;
  bool is_ng = false;
};

/// Where a step of the rundown begins: "snug".
struct StepMark {
  double at = 0;
  std::string word;
};

/// Torque over angle or time, one curve upon the other; NG ones last.
struct Curves {
  Caption caption;
  Quantity x;
  Quantity y;
  std::vector<Curve> curves;
  std::vector<StepMark> steps = {};
  std::vector<Level> levels = {};
};

std::string curves(const Curves& chart, Format format = Format::wide);

}  // namespace spindle::chart
