#include "report_records.hpp"

#include <string_view>

#include "exact_numbers.hpp"
#include "records.hpp"

namespace spindle::commands {
namespace {

using report::Cell;
using report::Field;
using statistics::Verdict;

Cell number_or_null(const std::optional<std::int64_t>& value) {
  return value ? number(*value) : Cell(std::monostate());
}

void add_stratum(const AssessedStratum& assessed, const work::Study& study,
                 report::Record& record) {
  const Stratum& stratum = *assessed.stratum;
  const work::StratumFacts& facts = stratum.facts;
  const store::Tool& tool = study.facts().tool(stratum.tool);
  const work::StudiedTool& missed = study.tool(stratum.tool);
  const auto share = [&](double statistics::Yield::*part) -> std::optional<double> {
    return assessed.yield ? std::optional((*assessed.yield).*part) : std::nullopt;
  };
  const std::optional<Decimal> target =
      facts.target
          ? std::optional(work::without_zeros(work::value_of(Quantity::torque, *facts.target)))
          : std::nullopt;
  report::Pairs codes;
  for (const auto& [code, counted] : stratum.codes) {
    codes.emplace_back(std::to_string(code), std::to_string(counted.count));
  }
  const std::vector<Field> fields = {
      {"maker", text_or_null(tool.name.maker)},
      {"serial", text_or_null(tool.name.serial)},
      {"preset", number_or_null(facts.preset)},
      {"target_torque", commands::number_or_null(target)},
      {"torque_unit", text_or_null(facts.torque_unit)},
      {"firmware", facts.firmware ? number(*facts.firmware) : Cell(std::monostate())},
      {"change", text_or_null(stratum.change)},
      {"first", report::to_text(stratum.results.front().at)},
      {"last", report::to_text(stratum.results.back().at)},
      {"results", count(stratum.results.size())},
      {"ok", count(stratum.ok)},
      {"ng", count(stratum.ng)},
      {"ng_codes", std::move(codes)},
      {"not_completed", count(stratum.not_completed)},
      {"meaning_unknown", count(stratum.unclear)},
      {"excluded", count(stratum.excluded)},
      {"missed", number(static_cast<std::int64_t>(missed.missed))},
      {"missed_at_least", missed.is_at_least},
      {"gaps", count(missed.gaps.size())},
      {"yield", commands::number_or_null(share(&statistics::Yield::share))},
      {"yield_low", commands::number_or_null(share(&statistics::Yield::low))},
      {"yield_high", commands::number_or_null(share(&statistics::Yield::high))}};
  record.fields.insert(record.fields.end(), fields.begin(), fields.end());
}

void add_index(std::string_view key, const std::optional<statistics::Indices>& indices,
               report::Record& record) {
  const statistics::Index* index = indices && indices->index ? &*indices->index : nullptr;
  const auto part = [&](double statistics::Index::*member) {
    return index != nullptr ? std::optional(index->*member) : std::nullopt;
  };
  const std::string name(key);
  record.fields.push_back(
      {name.substr(0, 2), commands::number_or_null(indices ? indices->centred : std::nullopt)});
  record.fields.push_back({name, commands::number_or_null(part(&statistics::Index::value))});
  record.fields.push_back({name + "_low", commands::number_or_null(part(&statistics::Index::low))});
  record.fields.push_back(
      {name + "_high", commands::number_or_null(part(&statistics::Index::high))});
}

void add_moments(const AssessedQuantity& quantity, const Stratum& stratum, const ReportZone& zone,
                 report::Record& record) {
  const statistics::Assessment& assessment = quantity.assessment;
  const work::QuantityLimits& limits = stratum.limits[quantity.quantity];
  const statistics::Moments& moments = assessment.moments;
  const std::vector<Field> fields = {
      {"n", count(moments.count())},
      {"mean", commands::number_or_null(moments.mean())},
      {"s", commands::number_or_null(moments.deviation())},
      {"s_within", commands::number_or_null(assessment.within)},
      {"smallest", commands::number_or_null(moments.min())},
      {"largest", commands::number_or_null(moments.max())},
      {"resolution", Cell(stratum.steps[quantity.quantity])},
      {"lower_limit", commands::number_or_null(limits.lower)},
      {"upper_limit", commands::number_or_null(limits.upper)},
      {"limits_origin", text_or_null(origin_of(limits, stratum, zone))}};
  record.fields.insert(record.fields.end(), fields.begin(), fields.end());
}

void add_stability(const AssessedQuantity& quantity, const Stratum& stratum, const ReportZone& zone,
                   report::Record& record) {
  const statistics::Assessment& assessment = quantity.assessment;
  Cell stable;
  Cell signals;
  std::optional<double> expected;
  std::optional<double> centre;
  std::optional<double> lower;
  std::optional<double> upper;
  Cell baseline;
  if (assessment.chart) {
    const statistics::Chart& chart = *assessment.chart;
    if (chart.stability.verdict != Verdict::not_judged) {
      stable = chart.stability.verdict == Verdict::stable;
    }
    signals = count(chart.stability.signals());
    expected = chart.stability.expected();
    centre = chart.limits.centre;
    lower = chart.limits.lower;
    upper = chart.limits.upper;
    baseline = count(chart.limits.baseline.count);
  }
  const std::vector<Field> fields = {
      {"stable", stable},
      {"signals", signals},
      {"signals_by_chance", commands::number_or_null(expected)},
      {"stability", reasons_of(quantity, stratum, zone)},
      {"autocorrelation", commands::number_or_null(assessment.autocorrelation)},
      {"centre", commands::number_or_null(centre)},
      {"lower_control_limit", commands::number_or_null(lower)},
      {"upper_control_limit", commands::number_or_null(upper)},
      {"baseline", baseline},
      {"remarks", report::Texts(remarks_of(quantity, stratum))}};
  record.fields.insert(record.fields.end(), fields.begin(), fields.end());
}

report::Record record_of(const AssessedStratum& assessed, const AssessedQuantity& quantity,
                         const work::Study& study, const ReportZone& zone, const Clock& clock) {
  const Stratum& stratum = *assessed.stratum;
  report::Record record{
      .type = "report",
      .target = study.facts().place(stratum.place).name,
      .time = clock.wall(),
      .fields = {{"quantity", std::string(work::quantity_words.text(quantity.quantity))}}};
  add_stratum(assessed, study, record);
  add_moments(quantity, stratum, zone, record);
  const statistics::Assessment& assessment = quantity.assessment;
  add_index("ppk", assessment.performance, record);
  add_index("cpk", assessment.capability, record);
  record.fields.push_back(
      {"ppk_by_percentiles",
       commands::number_or_null(assessment.percentile ? std::optional(assessment.percentile->value)
                                                      : std::nullopt)});
  if (quantity.machine) add_index("cmk", quantity.machine, record);
  add_stability(quantity, stratum, zone, record);
  return record;
}

}  // namespace

std::vector<report::Record> report_records(const Assessed& assessed, const ReportZone& zone,
                                           const Clock& clock) {
  std::vector<report::Record> records;
  for (const AssessedStratum& stratum : assessed.strata) {
    for (const Quantity quantity : work::quantities) {
      records.push_back(
          record_of(stratum, stratum.quantities[quantity], *assessed.study, zone, clock));
    }
  }
  return records;
}

std::vector<report::Column> report_columns() {
  std::vector<report::Column> columns = {{"TARGET", "target"}, {"QUANTITY", "quantity"}};
  for (const char* key : {"maker",
                          "serial",
                          "preset",
                          "target_torque",
                          "torque_unit",
                          "firmware",
                          "change",
                          "first",
                          "last",
                          "results",
                          "ok",
                          "ng",
                          "ng_codes",
                          "not_completed",
                          "meaning_unknown",
                          "excluded",
                          "missed",
                          "missed_at_least",
                          "gaps",
                          "yield",
                          "yield_low",
                          "yield_high",
                          "n",
                          "mean",
                          "s",
                          "s_within",
                          "smallest",
                          "largest",
                          "resolution",
                          "lower_limit",
                          "upper_limit",
                          "limits_origin",
                          "pp",
                          "ppk",
                          "ppk_low",
                          "ppk_high",
                          "cp",
                          "cpk",
                          "cpk_low",
                          "cpk_high",
                          "ppk_by_percentiles",
                          "stable",
                          "signals",
                          "signals_by_chance",
                          "stability",
                          "autocorrelation",
                          "centre",
                          "lower_control_limit",
                          "upper_control_limit",
                          "baseline",
                          "remarks"}) {
    columns.push_back({key, key});
  }
  return columns;
}

}  // namespace spindle::commands
