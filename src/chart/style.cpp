#include <fmt/format.h>

#include "spindle/chart/figure.hpp"

namespace spindle::chart {

std::string_view style() {
  return R"(.chart{display:block;width:100%;height:auto;max-width:960px}
.chart-narrow{max-width:480px}
.chart-small{display:inline-block;width:180px;vertical-align:middle}
.chart text{font-variant-numeric:tabular-nums}
.chart-pair>.chart-narrow{display:none}
@media screen and (max-width:640px){
.chart-pair>.chart-wide{display:none}
.chart-pair>.chart-narrow{display:block}
}
@media print{
.chart{break-inside:avoid;print-color-adjust:exact;-webkit-print-color-adjust:exact}
.chart-grid{stroke:#cbd2d9}
.chart-quiet{fill:#323f4b}
}
)";
}

std::string pair(std::string_view wide, std::string_view narrow) {
  return fmt::format("<div class=\"chart-pair\">\n{}{}</div>\n", wide, narrow);
}

}  // namespace spindle::chart
