#pragma once

#include <string>
#include <vector>

#include "report_assessment.hpp"
#include "report_words.hpp"

namespace spindle::commands {

/// The report as lines for a terminal. What tools and users called themselves stands there as it
/// is.
std::vector<std::string> report_lines(const Assessed& assessed, const ReportZone& zone);

}  // namespace spindle::commands
