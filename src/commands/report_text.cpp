#include "report_text.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "exact_numbers.hpp"
#include "report_figures.hpp"
#include "spindle/base/text.hpp"
#include "spindle/base/utf8.hpp"
#include "spindle/chart/ticks.hpp"

namespace spindle::commands {
namespace {

using Row = std::vector<std::string>;

/// How many characters of a terminal the texts here take: none of them is a wide one.
std::size_t width_of(std::string_view text) {
  std::size_t width = 0;
  while (!text.empty()) {
    text.remove_prefix(first_code_point(text).length);
    ++width;
  }
  return width;
}

/// Rows below each other; the first and the last column begin at the left, others end at the right.
std::string aligned(const std::vector<Row>& rows) {
  std::vector<std::size_t> widths(rows.front().size());
  for (const Row& row : rows) {
    for (std::size_t at = 0; at < row.size(); ++at) {
      widths[at] = std::max(widths[at], width_of(row[at]));
    }
  }
  std::string text;
  for (const Row& row : rows) {
    std::string line;
    for (std::size_t at = 0; at < row.size(); ++at) {
      const std::string room(widths[at] - width_of(row[at]), ' ');
      const bool is_left = at == 0 || at + 1 == row.size();
      line += (at == 0 ? "" : "  ") + (is_left ? row[at] + room : room + row[at]);
    }
    line.erase(line.find_last_not_of(' ') + 1);
    text += line + '\n';
  }
  return text;
}

Row quantity_row(const AssessedQuantity& quantity, const Stratum& stratum, const ReportZone& zone) {
  const statistics::Assessment& assessment = quantity.assessment;
  const int decimals = decimals_of(stratum.steps[quantity.quantity]) + 1;
  const auto& index = assessment.performance.index;
  std::string stable =
      fmt::format("{}: {}", verdict_of(quantity), reasons_of(quantity, stratum, zone));
  if (assessment.capability && assessment.capability->index) {
    const statistics::Index& own = *assessment.capability->index;
    stable += fmt::format("; {} {} ({})", statistics::to_text(own.name),
                          chart::number_text(own.value, 2), bounds_of(own));
  }
  for (const std::string& remark : remarks_of(quantity, stratum)) stable += "; " + remark;
  if (quantity.machine && quantity.machine->index) {
    const statistics::Index& own = *quantity.machine->index;
    stable +=
        fmt::format("; {} {} ({}) of {}", statistics::to_text(own.name),
                    chart::number_text(own.value, 2), bounds_of(own), quantity.machine->count);
  }
  return {name_of(quantity.quantity),
          std::to_string(assessment.moments.count()),
          shown(assessment.moments.mean(), decimals),
          shown(assessment.moments.deviation(), decimals),
          shown(assessment.within, decimals),
          shown(assessment.performance.centred, 2),
          index ? chart::number_text(index->value, 2) : "\u2013",
          index ? bounds_of(*index) : "\u2013",
          std::move(stable)};
}

/// Where columns of a histogram line begin, in steps of the resolution.
struct Columns {
  std::int64_t first = 0;
  std::int64_t steps = 1;  ///< in each column
  std::size_t count = 1;
};

std::int64_t steps_of(double value, double step) { return std::llround(value / step); }

/// From limit to limit with some room where there are two, so that one rundown that went wrong does
/// not squeeze all others; else from the smallest value to the largest one.
Columns columns_of(const AssessedQuantity& quantity, double step) {
  constexpr std::int64_t most = 48;
  const statistics::Moments& moments = quantity.assessment.moments;
  std::int64_t low = steps_of(moments.min().value_or(0), step);
  std::int64_t high = steps_of(moments.max().value_or(0), step);
  const statistics::Specification& limits = quantity.specification;
  if (limits.is_usable() && limits.lower && limits.upper) {
    const auto lower = static_cast<std::int64_t>(std::ceil(*limits.lower / step - 1e-6));
    const auto upper = static_cast<std::int64_t>(std::floor(*limits.upper / step + 1e-6));
    const std::int64_t room = std::max<std::int64_t>((upper - lower) / 4, 1);
    low = std::max(std::min(low, lower), lower - room);
    high = std::min(std::max(high, upper), upper + room);
  }
  const std::int64_t span = std::max<std::int64_t>(high - low + 1, 1);
  Columns columns{.first = low, .steps = (span + most - 1) / most};
  columns.count = static_cast<std::size_t>((span + columns.steps - 1) / columns.steps);
  return columns;
}

using statistics::Side;

/// The first column whose values a lower limit allows, or the last one that an upper one does.
std::optional<std::int64_t> column_of(const std::optional<double>& limit, const Columns& columns,
                                      double step, Side side) {
  if (!limit) return std::nullopt;
  // A limit that is a step of the resolution must not lose it to the error of the division.
  constexpr double error = 1e-6;
  const double steps = *limit / step;
  const auto first = static_cast<std::int64_t>(side == Side::lower ? std::ceil(steps - error)
                                                                   : std::floor(steps + error));
  const std::int64_t distance = first - columns.first;
  if (distance < 0) return std::nullopt;
  return side == Side::lower ? (distance + columns.steps - 1) / columns.steps
                             : distance / columns.steps;
}

/// A character for each column, from an empty one to a full block.
std::string_view block_of(std::size_t count, std::size_t most) {
  constexpr std::array<std::string_view, 9> blocks = {
      " ", "\u2581", "\u2582", "\u2583", "\u2584", "\u2585", "\u2586", "\u2587", "\u2588"};
  if (count == 0) return blocks[0];
  const double share = static_cast<double>(count) / static_cast<double>(most);
  return blocks[static_cast<std::size_t>(std::clamp(std::ceil(share * 8), 1.0, 8.0))];
}

/// "torque    2.40 | ▁▃▅█▆▃▁ | 3.02": bars stand for limits.
std::string histogram_line(const AssessedQuantity& quantity, const Stratum& stratum) {
  if (quantity.values.values.empty()) return {};
  const Decimal& exact_step = stratum.steps[quantity.quantity];
  const double step = to_double(exact_step);
  const Columns columns = columns_of(quantity, step);
  std::vector<std::size_t> counts(columns.count);
  std::size_t below = 0;
  std::size_t above = 0;
  for (const double value : quantity.values.values) {
    const std::int64_t at = steps_of(value, step) - columns.first;
    const std::int64_t column = at / columns.steps;
    if (at < 0) {
      ++below;
    } else if (column >= static_cast<std::int64_t>(columns.count)) {
      ++above;
    } else {
      ++counts[static_cast<std::size_t>(column)];
    }
  }
  const std::size_t most =
      std::max<std::size_t>(*std::max_element(counts.begin(), counts.end()), 1);
  std::string bars;
  const auto lower = column_of(quantity.specification.lower, columns, step, Side::lower);
  const auto upper = column_of(quantity.specification.upper, columns, step, Side::upper);
  for (std::size_t at = 0; at < counts.size(); ++at) {
    const auto place = static_cast<std::int64_t>(at);
    if (lower == place) bars += "\u2503";
    bars += block_of(counts[at], most);
    if (upper == place) bars += "\u2503";
  }
  const int decimals = decimals_of(exact_step);
  const auto edge = [&](std::int64_t steps) {
    return chart::number_text(static_cast<double>(steps) * step, decimals);
  };
  const auto last = columns.first + columns.steps * static_cast<std::int64_t>(columns.count) - 1;
  std::string text = fmt::format("{:<9} {} {} {}", name_of(quantity.quantity), edge(columns.first),
                                 bars, edge(last));
  if (below > 0) text += fmt::format("   {} below", below);
  if (above > 0) text += fmt::format("   {} above", above);
  return text + '\n';
}

std::string heading_of(const AssessedStratum& assessed, const work::StoreFacts& facts,
                       const ReportZone& zone) {
  const Stratum& stratum = *assessed.stratum;
  const store::Tool& tool = facts.tool(stratum.tool);
  std::string text = facts.place(stratum.place).name;
  text += fmt::format("  serial {}", tool.name.serial);
  if (stratum.facts.preset) text += fmt::format("  preset {}", *stratum.facts.preset);
  if (stratum.facts.target) text += "  target " + target_of(stratum);
  const work::QuantityLimits& limits = stratum.limits[Quantity::torque];
  const std::string range = range_of(limits);
  const std::string origin = origin_of(limits, stratum, zone);
  text += range.empty() ? fmt::format(", no limits ({})", origin)
                        : fmt::format(", limits {} ({})", range, origin);
  const work::QuantityLimits& angle = stratum.limits[Quantity::angle];
  if (angle.is_any()) {
    text += fmt::format(", angle {} ({})", range_of(angle), origin_of(angle, stratum, zone));
  }
  text += '\n';
  if (!stratum.change.empty()) {
    text +=
        fmt::format("from {} on: {}\n", zone.minute(stratum.results.front().at), stratum.change);
  }
  return text;
}

std::string counts_of(const AssessedStratum& assessed, const work::Study& study) {
  const Stratum& stratum = *assessed.stratum;
  const std::size_t results = stratum.ok + stratum.ng;
  std::string text = fmt::format("results {}   OK {}   NG {}", results, stratum.ok, stratum.ng);
  if (stratum.ng > 0) {
    const double share = static_cast<double>(stratum.ng) / static_cast<double>(results);
    text += fmt::format(" ({} %: {})", chart::number_text(share * 100, 2), codes_of(stratum));
  }
  if (assessed.yield) {
    const auto percent = [](double share) { return chart::number_text(share * 100, 2); };
    text += fmt::format("   yield {} % ({}\u2026{})", percent(assessed.yield->share),
                        percent(assessed.yield->low), percent(assessed.yield->high));
  }
  return text + fmt::format("   missed {}\n", missed_words(stratum, study));
}

std::string stratum_text(const AssessedStratum& assessed, const work::Study& study,
                         const ReportZone& zone) {
  const Stratum& stratum = *assessed.stratum;
  std::string text = heading_of(assessed, study.facts(), zone) + counts_of(assessed, study);
  std::vector<Row> rows = {
      {"QUANTITY", "N", "MEAN", "S", "S WITHIN", "PP", "PPK", "95 %", "STABLE"}};
  std::string histograms;
  for (const Quantity quantity : work::quantities) {
    if (!has_values(assessed, quantity)) continue;
    rows.push_back(quantity_row(assessed.quantities[quantity], stratum, zone));
    histograms += histogram_line(assessed.quantities[quantity], stratum);
  }
  text += aligned(rows) + histograms;
  for (const std::string& line : left_out_of(stratum, study.options())) text += line + '\n';
  return text;
}

std::string exclusions_text(const work::Study& study) {
  std::string text;
  for (const work::Exclusion& exclusion : study.exclusions()) {
    text += fmt::format("excluded: {}/{}/{}: {} ({})\n", exclusion.serial, exclusion.epoch,
                        exclusion.number, exclusion.reason,
                        exclusion.is_found ? exclusion.value : "not among these results");
  }
  return text;
}

/// What the figures rest on, where it is not certain.
std::string notes_text(const Assessed& assessed) {
  std::set<std::string> evidence;
  for (const CodeRow& row : code_rows(assessed)) {
    if (!row.evidence.empty()) evidence.insert(row.evidence);
  }
  std::string text;
  if (!evidence.empty()) {
    text = fmt::format("What error codes mean: by evidence {}.\n", fmt::join(evidence, ", "));
  }
  const bool has_own =
      std::any_of(assessed.strata.begin(), assessed.strata.end(), [](const AssessedStratum& each) {
        return each.stratum->limits[Quantity::torque].origin == work::LimitsOrigin::tool;
      });
  if (has_own) text.append(limit_assumption) += '\n';
  return text;
}

}  // namespace

std::vector<std::string> report_lines(const Assessed& assessed, const ReportZone& zone) {
  const auto period = period_of(assessed.strata);
  if (!period) return {};
  std::string text = fmt::format("{} to {} {}, by the clock of the computer that recorded\n",
                                 zone.minute(period->from), zone.minute(period->to), zone.name());
  for (const AssessedStratum& stratum : assessed.strata) {
    text += '\n' + stratum_text(stratum, *assessed.study, zone);
  }
  text += '\n' + exclusions_text(*assessed.study) + notes_text(assessed);
  for (const std::string& line : assessed.unmet) text += line + '\n';
  text += no_capability_test;
  std::vector<std::string> lines;
  for (const std::string_view line : split(text, '\n')) lines.emplace_back(line);
  return lines;
}

}  // namespace spindle::commands
