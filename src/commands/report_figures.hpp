#pragma once

#include <span>
#include <string>
#include <vector>

#include "report_assessment.hpp"
#include "report_words.hpp"
#include "spindle/chart/run_chart.hpp"

namespace spindle::commands {

/// Strata of one tool and preset, one behind the other.
using Subject = std::span<const AssessedStratum>;

/// Whether time or the number of results runs to the right: time, unless most of it is pauses.
bool runs_along_time(Subject subject, Duration shift_break);

/// All results of a tool and preset, with NG ones, changes of settings, gaps and limits.
std::string run_figure(Subject subject, Quantity quantity, const work::Study& study,
                       const ReportZone& zone);
/// The same as data, for those who draw it otherwise.
chart::RunChart run_chart_of(Subject subject, Quantity quantity, const work::Study& study,
                             const ReportZone& zone);
/// That of one stratum, in the height of a table row.
std::string small_figure(const AssessedStratum& stratum, const work::Study& study,
                         const ReportZone& zone);
/// Of the values that are in the statistics, to stand beside another figure. Empty: there are none.
std::string histogram_figure(const AssessedStratum& stratum, Quantity quantity,
                             const work::Study& study, const ReportZone& zone);
/// To stand beside another figure. Empty: there are no control limits.
std::string control_figure(const AssessedStratum& stratum, Quantity quantity,
                           const work::Study& study, const ReportZone& zone);

/// NG results of one code and product, from all strata.
struct CodeRow {
  std::int64_t code = 0;
  std::size_t count = 0;
  work::Completeness completeness = work::Completeness::unclear;
  std::string text = {};      ///< what it means; empty: not known
  std::string evidence = {};  ///< of that
};
/// The most frequent one first. A code that two products have is two rows where it means different
/// things.
std::vector<CodeRow> code_rows(const Assessed& assessed);
std::string pareto_figure(const std::vector<CodeRow>& rows);

}  // namespace spindle::commands
