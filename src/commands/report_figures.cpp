#include "report_figures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "exact_numbers.hpp"
#include "spindle/chart/control_chart.hpp"
#include "spindle/chart/histogram.hpp"
#include "spindle/chart/pareto.hpp"
#include "spindle/chart/run_chart.hpp"
#include "spindle/statistics/histogram.hpp"

namespace spindle::commands {
namespace {

using chart::Format;
using chart::Level;
using chart::LevelKind;
using work::Completeness;

template <typename Chart, typename Draw>
std::string both(const Chart& chart, Draw draw) {
  return chart::pair(draw(chart, Format::wide), draw(chart, Format::narrow));
}

std::int64_t milliseconds_of(WallTime time) { return time.time_since_epoch().count(); }

chart::Quantity quantity_of(Quantity quantity, const Stratum& stratum) {
  return {.name = quantity == Quantity::torque ? "Torque" : "Angle a3",
          .unit = unit_of(quantity, stratum),
          .decimals = decimals_of(stratum.steps[quantity])};
}

std::string subject_name(const Stratum& stratum, const work::Study& study) {
  std::string name = study.facts().place(stratum.place).name;
  if (stratum.facts.preset) name += fmt::format(", preset {}", *stratum.facts.preset);
  return name;
}

std::string origin_word(const work::QuantityLimits& limits) {
  if (limits.origin == work::LimitsOrigin::tool) return "tool's own";
  return limits.origin == work::LimitsOrigin::file ? "tools file" : "given";
}

/// Specification limits and target.
std::vector<Level> levels_of(const AssessedStratum& assessed, Quantity quantity) {
  const Stratum& stratum = *assessed.stratum;
  const work::QuantityLimits& limits = stratum.limits[quantity];
  std::vector<Level> levels;
  const auto add = [&](const std::optional<Decimal>& limit, const char* name) {
    if (!limit) return;
    levels.push_back({.kind = LevelKind::specification_limit,
                      .value = to_double(*limit),
                      .name = name,
                      .origin = origin_word(limits)});
  };
  add(limits.upper, "USL");
  if (quantity == Quantity::torque && stratum.facts.target) {
    levels.push_back({.kind = LevelKind::target,
                      .value = to_double(work::value_of(quantity, *stratum.facts.target)),
                      .name = "target"});
  }
  add(limits.lower, "LSL");
  return levels;
}

/// Where a result of a subject stands in its charts.
class Places {
 public:
  Places(Subject subject, const work::Study& study)
      : is_time_(runs_along_time(subject, study.options().shift_break)) {}

  [[nodiscard]] bool is_time() const { return is_time_; }
  [[nodiscard]] std::int64_t of(const work::StudiedResult& result, std::size_t index) const {
    return is_time_ ? milliseconds_of(result.at) : static_cast<std::int64_t>(index) + 1;
  }
  [[nodiscard]] chart::Course course(const ReportZone& zone) const {
    if (!is_time_) return {};
    return {
        .along = chart::Along::time, .name = "Time", .utc_offset_minutes = zone.offset_minutes()};
  }

 private:
  bool is_time_;
};

/// Gaps of the tool, where they lie among the results: those between the two around it.
std::vector<chart::Gap> gaps_of(const Stratum& first, const std::vector<WallTime>& times,
                                const Places& places, const work::Study& study) {
  std::vector<chart::Gap> gaps;
  for (const store::Gap& gap : study.tool(first.tool).gaps) {
    const auto behind = std::upper_bound(times.begin(), times.end(), gap.began);
    if (behind == times.begin() || behind == times.end()) continue;
    const auto index = behind - times.begin();
    chart::Gap drawn{.from = index, .to = index + 1, .missed = gap.missed.value_or(0)};
    if (places.is_time()) {
      drawn.from = milliseconds_of(gap.began);
      drawn.to = milliseconds_of(gap.ended);
    }
    gaps.push_back(drawn);
  }
  return gaps;
}

void add_samples(const AssessedStratum& assessed, Quantity quantity, const Places& places,
                 Duration shift_break, std::vector<WallTime>& times, chart::RunChart& chart) {
  const double scale = quantity == Quantity::torque ? double{store::torque_scale} : 1.0;
  const work::StudiedResult* before = nullptr;
  for (const work::StudiedResult& result : assessed.stratum->results) {
    const std::size_t index = times.size();
    times.push_back(result.at);
    const auto& value = result.values[quantity];
    if (!value || result.is_excluded) continue;
    const bool is_first = before == nullptr || before->stretch != result.stretch ||
                          result.at - before->at > shift_break;
    chart.samples.push_back({.at = places.of(result, index),
                             .value = static_cast<double>(*value) / scale,
                             .is_ng = result.completeness != Completeness::ok,
                             .is_first = is_first});
    before = &result;
  }
}

// ---- control charts ----

int number_of(statistics::Rule rule) {
  switch (rule) {
    case statistics::Rule::beyond_limits:
      return 1;
    case statistics::Rule::two_of_three:
      return 2;
    case statistics::Rule::four_of_five:
      return 3;
    case statistics::Rule::one_side:
      break;
  }
  return 4;
}

Level control_level(double value, std::string name, LevelKind kind = LevelKind::control_limit) {
  return {.kind = kind, .value = value, .name = std::move(name)};
}

/// Points of a control chart: values, or means of subgroups, and where they stand.
struct Points {
  std::vector<double> values;
  std::vector<double> spread;       ///< S; empty: moving ranges of the values
  std::vector<std::size_t> firsts;  ///< index of the first value of each
  std::vector<std::size_t> breaks;
};

Points points_of(const AssessedQuantity& quantity) {
  const statistics::Chart& chart = *quantity.assessment.chart;
  if (chart.limits.kind == statistics::ChartKind::subgroups) {
    const statistics::Subgroups& groups = chart.subgroups;
    return {groups.means, groups.deviations, groups.firsts, groups.breaks};
  }
  Points points{quantity.values.values, {}, {}, quantity.values.breaks};
  points.firsts.resize(points.values.size());
  for (std::size_t at = 0; at < points.firsts.size(); ++at) points.firsts[at] = at;
  return points;
}

chart::ControlChart control_chart_of(const AssessedStratum& assessed, Quantity which,
                                     const Places& places) {
  const Stratum& stratum = *assessed.stratum;
  const AssessedQuantity& quantity = assessed.quantities[which];
  const statistics::Chart& known = *quantity.assessment.chart;
  const Points points = points_of(quantity);
  chart::ControlChart chart;
  chart.values.quantity = quantity_of(which, stratum);
  chart::ControlPanel variation{.quantity = quantity_of(which, stratum), .points = {}};
  const bool has_groups = !points.spread.empty();
  variation.quantity.name = has_groups ? "S" : "Moving range";
  std::vector<bool> is_first(points.values.size());
  if (!is_first.empty()) is_first.front() = true;
  for (const std::size_t at : points.breaks) is_first[at] = true;
  for (std::size_t at = 0; at < points.values.size(); ++at) {
    const std::size_t index = quantity.values.positions[points.firsts[at]];
    const std::int64_t place = places.is_time() ? milliseconds_of(stratum.results[index].at)
                                                : static_cast<std::int64_t>(at) + 1;
    chart.values.points.push_back(
        {.at = place, .value = points.values[at], .is_first = is_first[at]});
    const bool has_range = at > 0 && !is_first[at];
    if (has_groups) {
      variation.points.push_back(
          {.at = place, .value = points.spread[at], .is_first = is_first[at]});
    } else if (has_range) {
      variation.points.push_back({.at = place,
                                  .value = std::abs(points.values[at] - points.values[at - 1]),
                                  .is_first = at == 1 || is_first[at - 1]});
    }
  }
  for (const statistics::Signal& signal : known.signals) {
    int& number = chart.values.points[signal.index].signal;
    const int own = number_of(signal.rule);
    number = number == 0 ? own : std::min(number, own);
  }
  const statistics::ControlLimits& limits = known.limits;
  chart.values.levels = {control_level(limits.upper, "UCL"),
                         control_level(limits.centre, "mean", LevelKind::mean),
                         control_level(limits.lower, "LCL")};
  variation.levels = {control_level(limits.spread_upper, "UCL"),
                      control_level(limits.spread_centre, "mean", LevelKind::mean)};
  chart.variation = std::move(variation);
  return chart;
}

/// From which to which point the control limits come.
std::optional<chart::Baseline> baseline_of(const AssessedQuantity& quantity,
                                           const chart::ControlChart& drawn) {
  const statistics::Chart& chart = *quantity.assessment.chart;
  const statistics::IndexRange range = chart.limits.baseline;
  std::size_t first = range.first;
  std::size_t count = range.count;
  if (chart.limits.kind == statistics::ChartKind::subgroups) {
    const auto& firsts = chart.subgroups.firsts;
    first = static_cast<std::size_t>(std::lower_bound(firsts.begin(), firsts.end(), range.first) -
                                     firsts.begin());
    count = chart.limits.points;
  }
  const auto& points = drawn.values.points;
  if (count == 0 || first + count > points.size()) return std::nullopt;
  return chart::Baseline{.from = points[first].at,
                         .to = points[first + count - 1].at,
                         .word = fmt::format("baseline: {} values", range.count)};
}

std::string doubt_of(const AssessedQuantity& quantity) {
  if (quantity.assessment.is_too_coarse) return "resolution too coarse: signals prove little";
  if (!quantity.assessment.chart->stability.is_greyed) return {};
  return "neighbours depend on each other: signals prove little";
}

}  // namespace

bool runs_along_time(Subject subject, Duration shift_break) {
  Duration pauses = {};
  std::optional<WallTime> before;
  for (const AssessedStratum& each : subject) {
    for (const work::StudiedResult& result : each.stratum->results) {
      // Where a clock was set back, only the order tells what came first.
      if (before && result.at < *before) return false;
      if (before && result.at - *before > shift_break) pauses += result.at - *before;
      before = result.at;
    }
  }
  return pauses * 2 <= *before - subject.front().stratum->results.front().at;
}

chart::RunChart run_chart_of(Subject subject, Quantity quantity, const work::Study& study,
                             const ReportZone& zone) {
  const Stratum& first = *subject.front().stratum;
  const Places places(subject, study);
  chart::RunChart chart{.caption = {.title = fmt::format("Run chart of {}", name_of(quantity)),
                                    .description = fmt::format(
                                        "{}. Every result in the order in which it was stored.",
                                        subject_name(first, study))},
                        .course = places.course(zone),
                        .quantity = quantity_of(quantity, first),
                        .samples = {}};
  std::vector<WallTime> times;
  for (const AssessedStratum& each : subject) {
    const Stratum& stratum = *each.stratum;
    const std::int64_t begin = places.of(stratum.results.front(), times.size());
    if (&each != &subject.front()) chart.changes.push_back({.at = begin, .word = stratum.change});
    add_samples(each, quantity, places, study.options().shift_break, times, chart);
    for (Level level : levels_of(each, quantity)) {
      if (subject.size() > 1) {
        level.from = begin;
        level.to = places.of(stratum.results.back(), times.size() - 1);
      }
      chart.levels.push_back(std::move(level));
    }
  }
  chart.gaps = gaps_of(first, times, places, study);
  return chart;
}

std::string run_figure(Subject subject, Quantity quantity, const work::Study& study,
                       const ReportZone& zone) {
  const chart::RunChart chart = run_chart_of(subject, quantity, study, zone);
  return chart.samples.empty() ? std::string() : both(chart, &chart::run_chart);
}

std::string small_figure(const AssessedStratum& stratum, const work::Study& study,
                         const ReportZone& zone) {
  return chart::small_run_chart(run_chart_of(Subject(&stratum, 1), Quantity::torque, study, zone));
}

std::string histogram_figure(const AssessedStratum& assessed, Quantity which,
                             const work::Study& study, const ReportZone& zone) {
  const Stratum& stratum = *assessed.stratum;
  const AssessedQuantity& quantity = assessed.quantities[which];
  const double step = to_double(stratum.steps[which]);
  const auto classes = statistics::histogram(quantity.series(), step);
  if (!classes) return {};
  const statistics::Moments& moments = quantity.assessment.moments;
  chart::Histogram chart{
      .caption = {.title = fmt::format("Histogram of {}", name_of(which)),
                  .description = fmt::format("{}, from {} to {} {}.", subject_name(stratum, study),
                                             zone.minute(stratum.results.front().at),
                                             zone.minute(stratum.results.back().at), zone.name())},
      .quantity = quantity_of(which, stratum),
      .step = step,
      .first = classes->first_step,
      .steps_per_class = classes->steps,
      .classes = {},
      .levels = levels_of(assessed, which)};
  for (const std::size_t count : classes->counts) chart.classes.push_back({.count = count});
  for (std::size_t at = 0; at < quantity.values.values.size(); ++at) {
    const work::StudiedResult& result = stratum.results[quantity.values.positions[at]];
    if (result.completeness == Completeness::ok) continue;
    const auto steps = std::llround(quantity.values.values[at] / step) - classes->first_step;
    const auto index = static_cast<std::size_t>(steps / classes->steps);
    if (steps >= 0 && index < chart.classes.size()) ++chart.classes[index].ng;
  }
  if (moments.mean()) {
    chart.levels.push_back({.kind = LevelKind::mean, .value = *moments.mean(), .name = "mean"});
  }
  const auto deviation = moments.deviation();
  if (deviation && *deviation > 0 && moments.count() >= 30) {
    chart.normal = {.mean = *moments.mean(), .deviation = *deviation};
  }
  return chart::histogram(chart, Format::narrow);
}

std::string control_figure(const AssessedStratum& assessed, Quantity which,
                           const work::Study& study, const ReportZone& zone) {
  const AssessedQuantity& quantity = assessed.quantities[which];
  if (!quantity.assessment.chart) return {};
  const Stratum& stratum = *assessed.stratum;
  const Places places(Subject(&assessed, 1), study);
  chart::ControlChart chart = control_chart_of(assessed, which, places);
  const bool has_groups =
      quantity.assessment.chart->limits.kind == statistics::ChartKind::subgroups;
  chart.caption = {.title = fmt::format("Control chart of {}{}", name_of(which),
                                        has_groups ? ": means of 5 in a row" : ""),
                   .description = fmt::format(
                       "{}. Control limits come from the baseline, never from the specification.",
                       subject_name(stratum, study))};
  chart.course = places.course(zone);
  if (!places.is_time()) chart.course.name = has_groups ? "Subgroup" : "Result";
  chart.baseline = baseline_of(quantity, chart);
  chart.doubt = doubt_of(quantity);
  return chart::control_chart(chart, Format::narrow);
}

std::vector<CodeRow> code_rows(const Assessed& assessed) {
  std::map<std::pair<std::int64_t, std::string>, CodeRow> rows;
  const work::StoreFacts& facts = assessed.study->facts();
  for (const AssessedStratum& each : assessed.strata) {
    const auto& errors = facts.product(facts.place(each.stratum->place)).errors;
    for (const auto& [code, counted] : each.stratum->codes) {
      const std::int64_t wanted = code;
      const auto known = std::find_if(errors.begin(), errors.end(),
                                      [&](const auto& entry) { return entry.key == wanted; });
      CodeRow row{.code = code, .completeness = counted.completeness};
      if (known != errors.end()) {
        row.text = std::string(known->value.text);
        row.evidence = std::string(catalogue::to_text(known->value.evidence));
      }
      auto& sum = rows.try_emplace({code, row.text}, row).first->second;
      sum.count += counted.count;
    }
  }
  std::vector<CodeRow> sorted;
  for (auto& [key, row] : rows) sorted.push_back(std::move(row));
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const auto& a, const auto& b) { return a.count > b.count; });
  return sorted;
}

std::string pareto_figure(const std::vector<CodeRow>& rows) {
  chart::Pareto chart{.caption = {.title = "NG results by error code"}, .causes = {}};
  for (const CodeRow& row : rows) {
    chart.causes.push_back({.code = code_name(row.code),
                            .label = row.text.empty() ? "meaning unknown" : row.text,
                            .count = row.count});
  }
  return both(chart, &chart::pareto);
}

}  // namespace spindle::commands
