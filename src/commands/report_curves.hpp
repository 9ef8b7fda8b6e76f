#pragma once

#include <map>
#include <string>

#include "report_assessment.hpp"
#include "report_figures.hpp"
#include "spindle/store/reader.hpp"
#include "stored_curves.hpp"

namespace spindle::commands {

/// Curves by the id of their event.
using StoredCurves = std::map<store::RowId, StoredCurve>;

/// Those of the newest results of every stratum, NG ones first: as many as can be told apart when
/// they are drawn one upon the other.
Result<StoredCurves> load_curves(const Assessed& assessed, store::Reader& reader);

/// Torque over angle and over time, all curves of a tool and preset one upon the other, with the
/// steps of the newest. Empty: there are none.
std::string curve_figures(Subject subject, const work::Study& study, const StoredCurves& curves);

}  // namespace spindle::commands
