#include "report_tables.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "exact_numbers.hpp"
#include "spindle/base/text.hpp"
#include "spindle/chart/escape.hpp"
#include "spindle/chart/ticks.hpp"

namespace spindle::commands {
namespace {

using chart::escape;
using statistics::Verdict;

std::string head_cell(std::string_view text, std::string_view style = {}) {
  return style.empty() ? fmt::format("<th scope=\"col\">{}</th>", text)
                       : fmt::format("<th scope=\"col\" class=\"{}\">{}</th>", style, text);
}

std::string cell(std::string_view text) { return fmt::format("<td>{}</td>", escape(text)); }
std::string text_cell(std::string_view text) {
  return fmt::format("<td class=\"t\">{}</td>", escape(text));
}
std::string wide_cell(std::string_view text) {
  return fmt::format("<td class=\"w\">{}</td>", escape(text));
}

std::string table(const std::string& head, const std::string& rows) {
  return fmt::format(
      "<div class=\"scroll\"><table>\n<thead><tr>{}</tr></thead>\n<tbody>\n{}</tbody>\n"
      "</table></div>\n",
      head, rows);
}

/// "2.70 (2.59…2.81)".
std::string with_bounds(const std::optional<statistics::Indices>& indices) {
  if (!indices || !indices->index) return "\u2013";
  const statistics::Index& index = *indices->index;
  return fmt::format("{} ({})", chart::number_text(index.value, 2), bounds_of(index));
}

/// The name of the index where only one limit is known.
std::string named_index(const std::optional<statistics::Indices>& indices) {
  if (!indices || !indices->index) return "\u2013";
  const bool is_one_sided = !indices->centred;
  return is_one_sided
             ? fmt::format("{} {}", statistics::to_text(indices->index->name), with_bounds(indices))
             : with_bounds(indices);
}

std::string verdict_cell(const AssessedQuantity& quantity) {
  const std::string word = verdict_of(quantity);
  const bool is_bad = quantity.assessment.chart &&
                      quantity.assessment.chart->stability.verdict == Verdict::unstable;
  return is_bad ? fmt::format("<td class=\"t bad\">\u25b2 {}</td>", word) : text_cell(word);
}

/// Ppk, and below it Cpk.
std::string indices_cell(const AssessedQuantity& quantity) {
  const statistics::Assessment& assessment = quantity.assessment;
  const auto line = [](std::string_view name, const std::optional<statistics::Indices>& indices) {
    if (!indices || !indices->index) return fmt::format("{} \u2013", name);
    return fmt::format("{} {}", statistics::to_text(indices->index->name), with_bounds(indices));
  };
  return fmt::format("<td class=\"t\">{}<br/>{}</td>", line("Ppk", assessment.performance),
                     line("Cpk", assessment.capability));
}

std::string yield_text(const AssessedStratum& assessed) {
  if (!assessed.yield) return "\u2013";
  const auto percent = [](double share) { return chart::number_text(share * 100, 2); };
  return fmt::format("{} ({}\u2026{})", percent(assessed.yield->share),
                     percent(assessed.yield->low), percent(assessed.yield->high));
}

/// The same with the interval below.
std::string yield_lines(const AssessedStratum& assessed) {
  std::string text = yield_text(assessed);
  if (const auto space = text.find(' '); space != std::string::npos) {
    text.replace(space, 1, "<br/>");
  }
  return text;
}

std::string summary_row(const AssessedStratum& assessed, const work::Study& study,
                        const ReportZone& zone) {
  const Stratum& stratum = *assessed.stratum;
  const AssessedQuantity& torque = assessed.quantities[Quantity::torque];
  const AssessedQuantity& angle = assessed.quantities[Quantity::angle];
  const std::string preset =
      stratum.facts.preset ? fmt::format("preset {}, ", *stratum.facts.preset) : std::string();
  std::string from = zone.minute(stratum.results.front().at);
  from.replace(10, 1, "<br/>");
  std::string row = fmt::format(
      "<tr><th scope=\"row\" class=\"t\">{}<br/><span class=\"quiet\">{}{}</span></th>"
      "<td class=\"t\">{}</td>",
      escape(study.facts().place(stratum.place).name), preset, escape(target_of(stratum)), from);
  row += cell(std::to_string(stratum.results.size()));
  row += cell(std::to_string(stratum.ng));
  row += fmt::format("<td>{}</td>", yield_lines(assessed));
  row += cell(missed_of(study.tool(stratum.tool)));
  for (const AssessedQuantity* quantity : {&torque, &angle}) {
    row += indices_cell(*quantity) + verdict_cell(*quantity);
  }
  row += fmt::format("<td>{}</td></tr>\n", small_figure(assessed, study, zone));
  return row;
}

/// "2.439…2.981 N.m (tool's own, read 07:58)".
std::string limits_text(const Stratum& stratum, Quantity quantity, const ReportZone& zone) {
  const work::QuantityLimits& limits = stratum.limits[quantity];
  const std::string origin = origin_of(limits, stratum, zone);
  if (!limits.is_any()) return fmt::format("none ({})", origin);
  const std::string unit = unit_of(quantity, stratum);
  return fmt::format("{}{}{} ({})", range_of(limits), unit.empty() ? "" : " ", unit, origin);
}

std::string numbers_row(const AssessedStratum& assessed, Quantity which, const ReportZone& zone) {
  const Stratum& stratum = *assessed.stratum;
  const AssessedQuantity& quantity = assessed.quantities[which];
  const statistics::Assessment& assessment = quantity.assessment;
  const statistics::Moments& moments = assessment.moments;
  const int decimals = decimals_of(stratum.steps[which]);
  std::string row = fmt::format("<tr><th scope=\"row\" class=\"t\">{}</th>", name_of(which));
  row += wide_cell(limits_text(stratum, which, zone)) + cell(std::to_string(moments.count()));
  row += cell(shown(moments.mean(), decimals + 1)) + cell(shown(moments.deviation(), decimals + 1));
  row += cell(shown(assessment.within, decimals + 1)) + cell(shown(moments.min(), decimals));
  row += cell(shown(moments.max(), decimals)) + cell(shown(assessment.performance.centred, 2));
  row += cell(named_index(assessment.performance));
  const auto& capability = assessment.capability;
  row += cell(shown(capability ? capability->centred : std::nullopt, 2));
  row += cell(named_index(capability)) + verdict_cell(quantity) + "</tr>\n";
  return row;
}

/// What stands below the numbers: why stable or not, and what else has to be known.
std::string remarks_text(const AssessedStratum& assessed, Quantity which, const ReportZone& zone) {
  const Stratum& stratum = *assessed.stratum;
  const AssessedQuantity& quantity = assessed.quantities[which];
  if (quantity.values.values.empty()) return {};
  std::string text = reasons_of(quantity, stratum, zone);
  if (quantity.assessment.chart) {
    const statistics::ControlLimits& limits = quantity.assessment.chart->limits;
    const int decimals = decimals_of(stratum.steps[which]) + 1;
    text += fmt::format("; control limits {}\u2026{} from the baseline of {} values",
                        chart::number_text(limits.lower, decimals),
                        chart::number_text(limits.upper, decimals), limits.baseline.count);
  }
  for (const std::string& remark : remarks_of(quantity, stratum)) text += "; " + remark;
  if (quantity.machine && quantity.machine->index) {
    text += fmt::format("; {} {} of {} values without an interruption, no test by VDI/VDE 2645-2",
                        statistics::to_text(quantity.machine->index->name),
                        with_bounds(quantity.machine), quantity.machine->count);
  }
  return fmt::format("<li>{}: {}</li>\n", name_of(which), escape(text));
}

}  // namespace

std::string summary_table(const Assessed& assessed, const ReportZone& zone) {
  if (assessed.strata.empty()) return "<p>There is no result.</p>\n";
  std::string rows;
  for (const AssessedStratum& each : assessed.strata) {
    rows += summary_row(each, *assessed.study, zone);
  }
  std::string head = head_cell("Tool,<br/>preset, target", "t") + head_cell("From", "t");
  head += head_cell("Results") + head_cell("NG");
  head += head_cell("Yield %<br/>(95 %)") + head_cell("Missed<br/>of the tool");
  head += head_cell("Torque<br/>(95 %)", "t") + head_cell("Torque<br/>stable", "t");
  head += head_cell("Angle a3<br/>(95 %)", "t") + head_cell("Angle<br/>stable", "t");
  head += head_cell("Torque,<br/>result by result", "t");
  return table(head, rows);
}

std::string numbers_table(const AssessedStratum& assessed, const work::Study& study,
                          const ReportZone& zone) {
  const Stratum& stratum = *assessed.stratum;
  std::string rows;
  std::string remarks;
  for (const Quantity quantity : work::quantities) {
    if (!has_values(assessed, quantity)) continue;
    rows += numbers_row(assessed, quantity, zone);
    remarks += remarks_text(assessed, quantity, zone);
  }
  std::string head = head_cell("Quantity", "t") + head_cell("Limits", "w") + head_cell("n");
  head += head_cell("Mean") + head_cell("s") + head_cell("s within") + head_cell("Smallest");
  head += head_cell("Largest") + head_cell("Pp") + head_cell("Ppk (95 %)") + head_cell("Cp");
  head += head_cell("Cpk (95 %)") + head_cell("Stable", "t");
  std::string counts = fmt::format("{}: OK {}, NG {}", counted(stratum.results.size(), "result"),
                                   stratum.ok, stratum.ng);
  if (stratum.ng > 0) counts += fmt::format(" ({})", codes_of(stratum));
  counts +=
      fmt::format("; yield {} %; missed {}", yield_text(assessed), missed_words(stratum, study));
  for (const std::string& line : left_out_of(stratum, study.options())) counts += "; " + line;
  return table(head, rows) + fmt::format("<ul>\n<li>{}</li>\n{}</ul>\n", escape(counts), remarks);
}

std::string codes_table(const std::vector<CodeRow>& rows) {
  std::size_t all = 0;
  for (const CodeRow& row : rows) all += row.count;
  std::string text;
  std::size_t sum = 0;
  for (const CodeRow& row : rows) {
    sum += row.count;
    const auto percent = [&](std::size_t count) {
      return chart::number_text(
          100 * static_cast<double>(count) / static_cast<double>(std::max<std::size_t>(all, 1)), 1);
    };
    std::string counts = "meaning unknown: not in the statistics";
    if (row.completeness == work::Completeness::ng) counts = "completed: in the statistics";
    if (row.completeness == work::Completeness::not_completed) {
      counts = "not completed: not in the statistics";
    }
    text += fmt::format("<tr><th scope=\"row\" class=\"t\">{}</th>", code_name(row.code));
    text += wide_cell(row.text.empty() ? "\u2013" : row.text) + cell(std::to_string(row.count));
    text += cell(percent(row.count)) + cell(percent(sum)) + wide_cell(counts);
    text += text_cell(row.evidence.empty() ? "\u2013" : row.evidence) + "</tr>\n";
  }
  return table(head_cell("Code", "t") + head_cell("Meaning", "w") + head_cell("Count") +
                   head_cell("%") + head_cell("Cumulated %") + head_cell("Counts as", "w") +
                   head_cell("Evidence of the meaning", "t"),
               text);
}

std::string gaps_table(const work::Study& study, const ReportZone& zone) {
  std::string rows;
  std::size_t left = 0;
  constexpr std::size_t most = 200;
  std::size_t drawn = 0;
  for (const work::StudiedTool* tool : study.tools()) {
    for (const store::Gap& gap : tool->gaps) {
      if (++drawn > most) {
        ++left;
        continue;
      }
      const auto number = [](const std::optional<std::uint16_t>& value) {
        return value ? std::to_string(*value) : std::string("\u2013");
      };
      const std::string missed =
          gap.missed ? fmt::format("{}{}", *gap.missed, gap.at_least ? " or more" : "") : "unknown";
      rows += fmt::format("<tr><th scope=\"row\" class=\"t\">{}</th>",
                          escape(study.facts().tool(gap.tool).name.serial));
      rows += cell(std::to_string(gap.epoch)) + cell(number(gap.after)) + cell(number(gap.before));
      rows += cell(missed) + text_cell(zone.minute(gap.began)) + text_cell(zone.minute(gap.ended));
      rows += wide_cell(gap.reason) + "</tr>\n";
    }
  }
  if (rows.empty()) return "<p>None is known.</p>\n";
  std::string text =
      table(head_cell("Serial", "t") + head_cell("Epoch") + head_cell("After<br/>number") +
                head_cell("Before<br/>number") + head_cell("Events<br/>missed") +
                head_cell("From", "t") + head_cell("To", "t") + head_cell("Reason", "w"),
            rows);
  if (left > 0) {
    text += fmt::format("<p>And {} more: 'spindle results --gaps' lists all.</p>\n", left);
  }
  return text;
}

}  // namespace spindle::commands
