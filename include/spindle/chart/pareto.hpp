#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "spindle/chart/figure.hpp"

namespace spindle::chart {

struct Cause {
  std::string code;
  std::string label;
  std::uint64_t count = 0;
};

/// Causes in any order. Those behind the eleven most frequent ones become one bar.
struct Pareto {
  Caption caption;
  std::string counted = "NG results";
  std::vector<Cause> causes;
};

std::string pareto(const Pareto& chart, Format format = Format::wide);

}  // namespace spindle::chart
