#pragma once

#include <string>
#include <string_view>

#include "spindle/chart/run_chart.hpp"

/// What makes the run charts of a page zoom: uPlot, and a script that hands it the data. Without
/// scripts, and on paper, the figures stay as they are.
namespace spindle::commands {

/// uPlot itself; made from third_party by the build.
std::string_view uplot_script();
std::string_view uplot_style();

/// The Content-Security-Policy that lets exactly these scripts run.
std::string_view zoom_policy();
std::string_view zoom_style();

/// A run chart that zooms, with the figure that stands there without scripts. Of many samples only
/// the largest and smallest of neighbours are kept.
std::string zooming(const std::string& figure, const chart::RunChart& chart);

/// Both scripts, for the end of the page.
std::string zoom_scripts();

}  // namespace spindle::commands
