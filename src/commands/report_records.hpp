#pragma once

#include <vector>

#include "report_assessment.hpp"
#include "report_words.hpp"

namespace spindle::commands {

/// A `report` record for each stratum and quantity.
std::vector<report::Record> report_records(const Assessed& assessed, const ReportZone& zone,
                                           const Clock& clock);
/// The columns of CSV: every field.
std::vector<report::Column> report_columns();

}  // namespace spindle::commands
