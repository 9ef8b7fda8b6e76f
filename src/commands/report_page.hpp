#pragma once

#include <string>

#include "report_assessment.hpp"
#include "report_curves.hpp"
#include "report_words.hpp"

namespace spindle::commands {

struct PageFacts {
  ReportZone zone = {};
  WallTime made = {};
  std::string version = {};  ///< of spindle
  const ReportOptions& options;
  const StoredCurves& curves;
};

/// The report as one page that needs nothing else: no script, no request.
std::string report_page(const Assessed& assessed, const PageFacts& facts);

}  // namespace spindle::commands
