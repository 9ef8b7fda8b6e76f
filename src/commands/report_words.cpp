#include "report_words.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "exact_numbers.hpp"
#include "spindle/base/text.hpp"
#include "spindle/chart/ticks.hpp"

namespace spindle::commands {
namespace {

using statistics::Verdict;
using work::Completeness;

std::string joined(std::string text, const std::string& part, std::string_view between = "; ") {
  if (part.empty()) return text;
  return text.empty() ? part : text.append(between).append(part);
}

std::int64_t milliseconds_of(WallTime time) { return time.time_since_epoch().count(); }

template <typename Wanted>
std::string codes_text(const Stratum& stratum, Wanted is_wanted) {
  std::vector<std::pair<std::int64_t, std::size_t>> codes;
  for (const auto& [code, counted] : stratum.codes) {
    if (is_wanted(counted)) codes.emplace_back(code, counted.count);
  }
  std::stable_sort(codes.begin(), codes.end(),
                   [](const auto& a, const auto& b) { return a.second > b.second; });
  std::string text;
  for (const auto& [code, count] : codes) {
    text = joined(std::move(text), fmt::format("{} {}", code_name(code), count), ", ");
  }
  return text;
}

/// In which times the mean was shifted; the first ones of many.
std::string periods_text(const AssessedQuantity& quantity, const Stratum& stratum,
                         const ReportZone& zone) {
  constexpr std::size_t most = 3;
  const statistics::Chart& chart = *quantity.assessment.chart;
  std::string text;
  for (std::size_t at = 0; at < std::min(most, chart.periods.size()); ++at) {
    const statistics::Period& period = chart.periods[at];
    const statistics::IndexRange range = chart.values_of(period.points);
    if (range.count == 0) continue;
    const auto time_of = [&](std::size_t index) {
      return stratum.results[quantity.values.positions[index]].at;
    };
    const WallTime from = time_of(range.first);
    const WallTime to = time_of(range.end() - 1);
    const WallTime begin = stratum.results.front().at;
    text = joined(std::move(text),
                  fmt::format("mean {} {}\u2013{}",
                              period.side == statistics::Side::upper ? "higher" : "lower",
                              zone.beside(from, begin), zone.beside(to, from)),
                  ", ");
  }
  if (chart.periods.size() > most) {
    text += fmt::format(" and {} more", counted(chart.periods.size() - most, "time"));
  }
  return text;
}

}  // namespace

std::string ReportZone::minute(WallTime time) const {
  return chart::time_text(milliseconds_of(time), offset_minutes()).substr(0, 16);
}

std::string ReportZone::clock(WallTime time) const { return minute(time).substr(11); }

std::string ReportZone::beside(WallTime time, WallTime other) const {
  const std::string text = minute(time);
  return text.substr(0, 10) == minute(other).substr(0, 10) ? text.substr(11) : text;
}

std::string ReportZone::name() const { return chart::zone_text(offset_minutes()); }

std::string name_of(Quantity quantity) {
  return quantity == Quantity::torque ? "torque" : "angle a3";
}

std::string unit_of(Quantity quantity, const Stratum& stratum) {
  return quantity == Quantity::torque ? stratum.facts.torque_unit : "deg";
}

int decimals_of(const Decimal& step) { return std::max(0, -step.exponent()); }

std::string shown(const std::optional<double>& value, int decimals) {
  return value ? chart::number_text(*value, decimals) : "\u2013";
}

std::string shown(const std::optional<Decimal>& value) {
  return value ? work::without_zeros(*value).to_string() : "\u2013";
}

std::string range_of(const work::QuantityLimits& limits) {
  if (limits.lower && limits.upper) {
    return fmt::format("{}\u2026{}", shown(limits.lower), shown(limits.upper));
  }
  if (limits.lower) return fmt::format("from {}", shown(limits.lower));
  return limits.upper ? fmt::format("up to {}", shown(limits.upper)) : std::string();
}

std::string origin_of(const work::QuantityLimits& limits, const Stratum& stratum,
                      const ReportZone& zone) {
  switch (limits.origin) {
    case work::LimitsOrigin::given:
      return "given";
    case work::LimitsOrigin::file:
      return "of the tools file";
    case work::LimitsOrigin::tool:
      return fmt::format("tool's own, read {}",
                         zone.beside(stratum.facts.settings->since, stratum.results.front().at));
    case work::LimitsOrigin::none:
      break;
  }
  return limits.why_none;
}

bool has_values(const AssessedStratum& stratum, Quantity quantity) {
  return quantity == Quantity::torque || !stratum.quantities[quantity].values.values.empty();
}

std::string code_name(std::int64_t code) {
  return code == 0 ? "no code" : fmt::format("E{}", code);
}

std::string codes_of(const Stratum& stratum) {
  return codes_text(stratum, [](const work::CodeCount&) { return true; });
}

std::string codes_of(const Stratum& stratum, Completeness completeness) {
  return codes_text(stratum, [&](const work::CodeCount& counted) {
    return counted.completeness == completeness;
  });
}

std::string missed_of(const work::StudiedTool& tool) {
  if (!tool.is_at_least) return std::to_string(tool.missed);
  return tool.missed == 0 ? "an unknown number" : fmt::format("{} or more", tool.missed);
}

std::string missed_words(const Stratum& stratum, const work::Study& study) {
  const std::vector<const Stratum*> all = study.strata();
  const auto of_tool = std::count_if(
      all.begin(), all.end(), [&](const Stratum* each) { return each->tool == stratum.tool; });
  const work::StudiedTool& tool = study.tool(stratum.tool);
  return missed_of(tool) + (of_tool > 1 && !tool.gaps.empty() ? " of this tool" : "");
}

std::string target_of(const Stratum& stratum) {
  if (!stratum.facts.target) return "\u2013";
  const Decimal target = work::value_of(Quantity::torque, *stratum.facts.target);
  std::string text = work::with_least_decimals(target, stratum.steps[Quantity::torque]).to_string();
  if (!stratum.facts.torque_unit.empty()) text += " " + stratum.facts.torque_unit;
  return text;
}

std::string bounds_of(const statistics::Index& index) {
  return fmt::format("{}\u2026{}", chart::number_text(index.low, 2),
                     chart::number_text(index.high, 2));
}

std::string why_no_index(const AssessedQuantity& quantity) {
  const statistics::Indices& performance = quantity.assessment.performance;
  if (performance.index) return {};
  if (!quantity.specification.lower && !quantity.specification.upper) return "no limits";
  if (!quantity.specification.is_usable()) return "the limits are not in order";
  if (performance.amount == statistics::Amount::too_few) {
    return fmt::format("only {}, 30 are needed", counted(performance.count, "value"));
  }
  return "all values are equal";
}

std::string verdict_of(const AssessedQuantity& quantity) {
  if (!quantity.assessment.chart) return "\u2013";
  switch (quantity.assessment.chart->stability.verdict) {
    case Verdict::stable:
      return "yes";
    case Verdict::unstable:
      return "no";
    case Verdict::not_judged:
      break;
  }
  return "not judged";
}

std::string reasons_of(const AssessedQuantity& quantity, const Stratum& stratum,
                       const ReportZone& zone) {
  const statistics::Assessment& assessment = quantity.assessment;
  if (!assessment.chart) {
    if (assessment.is_too_coarse) return "resolution too coarse";
    return assessment.moments.count() < 25 ? "25 values are needed" : "no control limits";
  }
  const statistics::Stability& stability = assessment.chart->stability;
  const double expected = stability.expected();
  std::string text = fmt::format("{}, {} by chance", counted(stability.signals(), "signal"),
                                 expected < 1 ? "less than 1" : fmt::format("{:.0f}", expected));
  if (assessment.is_too_coarse) text = joined(std::move(text), "resolution too coarse");
  if (stability.is_greyed) {
    text = joined(std::move(text), fmt::format("neighbours depend on each other ({:.2f})",
                                               stability.autocorrelation.value_or(0)));
  }
  if (stability.verdict == Verdict::unstable) {
    text = joined(std::move(text), periods_text(quantity, stratum, zone));
  }
  return text;
}

std::vector<std::string> remarks_of(const AssessedQuantity& quantity, const Stratum& stratum) {
  std::vector<std::string> remarks;
  const statistics::Assessment& assessment = quantity.assessment;
  const statistics::Indices& performance = assessment.performance;
  if (performance.index && performance.amount == statistics::Amount::few) {
    remarks.push_back(fmt::format("only {}; 50 are better", counted(performance.count, "value")));
  }
  if (performance.index && !performance.centred) remarks.emplace_back("one limit");
  if (assessment.percentile && assessment.percentile->differs) {
    remarks.push_back(fmt::format("not normal: {} by percentiles {}",
                                  statistics::to_text(assessment.percentile->name),
                                  chart::number_text(assessment.percentile->value, 2)));
  }
  if (assessment.is_too_coarse) {
    remarks.push_back(fmt::format("values in steps of {}, too coarse for s within",
                                  shown(stratum.steps[quantity.quantity])));
  }
  if (const std::string why = why_no_index(quantity); !why.empty()) remarks.push_back(why);
  return remarks;
}

std::vector<std::string> left_out_of(const Stratum& stratum, const work::StudyOptions& options) {
  std::vector<std::string> lines;
  if (stratum.not_completed > 0 && !options.include_not_completed) {
    lines.push_back(fmt::format("not completed and left out of the statistics: {} ({})",
                                stratum.not_completed,
                                codes_of(stratum, Completeness::not_completed)));
  }
  if (stratum.not_completed > 0 && options.include_not_completed) {
    lines.push_back(fmt::format("not completed, yet in the statistics as you asked: {} ({})",
                                stratum.not_completed,
                                codes_of(stratum, Completeness::not_completed)));
  }
  if (stratum.unclear > 0) {
    lines.push_back(fmt::format("meaning unknown and left out of the statistics: {} ({})",
                                stratum.unclear, codes_of(stratum, Completeness::unclear)));
  }
  if (stratum.excluded > 0) {
    lines.push_back(fmt::format("excluded by you from the statistics, not from the yield: {}",
                                stratum.excluded));
  }
  if (stratum.of_unknown_age > 0) {
    lines.push_back(
        fmt::format("fetched from the tool's memory: {}; their times are \"not later than\"",
                    stratum.of_unknown_age));
  }
  return lines;
}

std::optional<Period> period_of(const std::vector<AssessedStratum>& strata) {
  std::optional<Period> period;
  for (const AssessedStratum& each : strata) {
    const WallTime from = each.stratum->results.front().at;
    const WallTime to = each.stratum->results.back().at;
    if (!period) period = Period{from, to};
    period->from = std::min(period->from, from);
    period->to = std::max(period->to, to);
  }
  return period;
}

}  // namespace spindle::commands
