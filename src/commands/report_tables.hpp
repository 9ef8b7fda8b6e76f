#pragma once

#include <string>
#include <vector>

#include "report_assessment.hpp"
#include "report_figures.hpp"
#include "report_words.hpp"

/// The tables of a report's page, as HTML.
namespace spindle::commands {

/// A row for each stratum.
std::string summary_table(const Assessed& assessed, const ReportZone& zone);
/// All numbers of one stratum.
std::string numbers_table(const AssessedStratum& stratum, const work::Study& study,
                          const ReportZone& zone);
std::string codes_table(const std::vector<CodeRow>& rows);
/// What is missing, of every tool.
std::string gaps_table(const work::Study& study, const ReportZone& zone);

}  // namespace spindle::commands
