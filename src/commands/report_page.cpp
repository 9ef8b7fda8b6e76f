#include "report_page.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "report_figures.hpp"
#include "report_tables.hpp"
#include "report_zoom.hpp"
#include "spindle/base/duration.hpp"
#include "spindle/base/text.hpp"
#include "spindle/chart/escape.hpp"
#include "spindle/chart/figure.hpp"

namespace spindle::commands {
namespace {

using chart::escape;

/// So many strata have all figures; a page of more would be read by none.
constexpr std::size_t most_in_full = 6;
/// So many have a table of their own.
constexpr std::size_t most_tables = 60;

constexpr std::string_view no_scripts = "default-src 'none'; style-src 'unsafe-inline'";

constexpr std::string_view page_style = R"(
:root{color-scheme:light}
*{box-sizing:border-box}
body{font:15px/1.45 system-ui,"Segoe UI",Roboto,"Helvetica Neue",Arial,sans-serif;color:#1f2933;background:#fff;margin:0 auto;max-width:1240px;padding:24px}
h1{font-size:26px;line-height:1.2;margin:0 0 4px}
h2{font-size:20px;line-height:1.25;margin:40px 0 8px;padding-top:12px;border-top:2px solid #1f2933}
h3{font-size:16px;margin:24px 0 8px}
p{margin:4px 0 8px;max-width:80ch}
.lead{font-size:17px;margin:0}
.quiet{color:#52606d;font-weight:400}
.scroll{overflow-x:auto}
table{border-collapse:collapse;font-size:13px;font-variant-numeric:tabular-nums;margin:8px 0 16px}
caption{text-align:left;font-weight:600;padding:4px 0}
th,td{padding:5px 8px;border-bottom:1px solid #d5dbe1;text-align:right;vertical-align:top;white-space:nowrap}
th{font-weight:600;border-bottom:1.5px solid #52606d;vertical-align:bottom}
th[scope=row]{border-bottom:1px solid #d5dbe1;vertical-align:top}
.t{text-align:left}
.w{text-align:left;white-space:normal;min-width:16ch}
.bad{color:#a61b1b;font-weight:600}
.box{border:2px solid #a61b1b;padding:8px 14px;margin:16px 0;max-width:80ch}
.chart-pair{margin:12px 0}
.figures{margin-top:16px;display:grid;grid-template-columns:repeat(2,minmax(0,464px));gap:16px 32px;align-items:start}
ul{margin:4px 0 8px;padding-left:20px;max-width:90ch}
@media screen and (max-width:900px){.figures{grid-template-columns:minmax(0,480px)}}
@media screen and (max-width:640px){body{padding:14px}h1{font-size:22px}}
@media print{
@page{size:A4;margin:12mm}
body{max-width:none;padding:0;font-size:11px}
.lead{font-size:13px}
h1{font-size:20px}h2{font-size:15px;margin-top:20px;break-after:avoid}h3{font-size:12px;break-after:avoid}
table{font-size:9px}th,td{padding:2px 5px}
tr,.box,.figures>div{break-inside:avoid}
.scroll{overflow:visible}
.figures{gap:8px 12px}
}
)";

/// Strata of one tool and preset stand behind each other.
std::vector<Subject> subjects_of(const Assessed& assessed) {
  std::vector<Subject> subjects;
  const std::vector<AssessedStratum>& strata = assessed.strata;
  for (std::size_t first = 0; first < strata.size();) {
    std::size_t end = first + 1;
    const Stratum& own = *strata[first].stratum;
    while (end < strata.size() && strata[end].stratum->tool == own.tool &&
           strata[end].stratum->facts.preset == own.facts.preset) {
      ++end;
    }
    subjects.emplace_back(&strata[first], end - first);
    first = end;
  }
  return subjects;
}

/// Which strata are drawn in full: those with most results, with all of their subject.
class Choice {
 public:
  explicit Choice(const std::vector<Subject>& subjects) {
    std::vector<Subject> sorted = subjects;
    const auto results_of = [](Subject subject) {
      std::size_t results = 0;
      for (const AssessedStratum& each : subject) results += each.stratum->results.size();
      return results;
    };
    std::stable_sort(sorted.begin(), sorted.end(),
                     [&](Subject a, Subject b) { return results_of(a) > results_of(b); });
    std::size_t strata = 0;
    for (const Subject subject : sorted) {
      strata += subject.size();
      if (strata > most_in_full && !chosen_.empty()) break;
      chosen_.push_back(subject.data());
    }
  }
  [[nodiscard]] bool has(Subject subject) const {
    return std::find(chosen_.begin(), chosen_.end(), subject.data()) != chosen_.end();
  }
  [[nodiscard]] std::size_t size() const { return chosen_.size(); }

 private:
  std::vector<const AssessedStratum*> chosen_ = {};
};

class Page {
 public:
  Page(const Assessed& assessed, const PageFacts& facts)
      : assessed_(&assessed),
        study_(assessed.study),
        facts_(&facts),
        subjects_(subjects_of(assessed)),
        choice_(subjects_) {}

  std::string draw() {
    head();
    summary();
    for (const Subject subject : subjects_) {
      if (choice_.has(subject)) add_subject(subject);
    }
    other_strata();
    ng_results();
    out_ += "<h2>Missing results</h2>\n" + gaps_table(*study_, zone());
    left_out();
    how_computed();
    if (is_interactive()) out_ += zoom_scripts();
    out_ += "</body>\n</html>\n";
    return std::move(out_);
  }

 private:
  [[nodiscard]] const ReportZone& zone() const { return facts_->zone; }
  [[nodiscard]] bool is_interactive() const { return facts_->options.interactive; }

  template <typename... Parts>
  void add(fmt::format_string<Parts...> format, Parts&&... parts) {
    fmt::format_to(std::back_inserter(out_), format, std::forward<Parts>(parts)...);
  }

  void head() {
    const auto period = period_of(assessed_->strata);
    const std::string when = period ? fmt::format("{} to {} {}", zone().minute(period->from),
                                                  zone().minute(period->to), zone().name())
                                    : "no results";
    out_ +=
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n"
        "<meta http-equiv=\"Content-Security-Policy\" content=\"";
    out_ += is_interactive() ? zoom_policy() : no_scripts;
    out_ +=
        "\"/>\n"
        "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n";
    add("<title>Fastening results, {}</title>\n<style>{}{}", when, page_style, chart::style());
    if (is_interactive()) add("{}{}", uplot_style(), zoom_style());
    out_ += "</style>\n</head>\n<body>\n";
    add("<h1>Fastening results</h1>\n<p class=\"lead\">{}</p>\n", when);
    add("<p class=\"quiet\">{}. All times are {}, by the clock of the computer that recorded. Made "
        "{} by spindle {}.</p>\n",
        escape(tool_names()), zone().name(), zone().minute(facts_->made), escape(facts_->version));
    if (assessed_->unmet.empty()) return;
    out_ += "<div class=\"box\"><strong class=\"bad\">Not met</strong>\n<ul>\n";
    for (const std::string& line : assessed_->unmet) add("<li>{}</li>\n", escape(line));
    out_ += "</ul></div>\n";
  }

  [[nodiscard]] std::string tool_names() const {
    constexpr std::size_t most = 12;
    std::vector<std::string> names;
    for (const AssessedStratum& each : assessed_->strata) {
      const Stratum& stratum = *each.stratum;
      const std::string name =
          fmt::format("{} (serial {})", study_->facts().place(stratum.place).name,
                      study_->facts().tool(stratum.tool).name.serial);
      if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
    }
    std::string text;
    for (std::size_t at = 0; at < std::min(most, names.size()); ++at) {
      text += (at == 0 ? "" : ", ") + names[at];
    }
    if (names.size() > most) text += fmt::format(" and {} more", names.size() - most);
    return text.empty() ? "No tool" : text;
  }

  void summary() {
    out_ += "<h2>Summary</h2>\n";
    out_ += summary_table(*assessed_, zone());
    add("<p>{}</p>\n", escape(no_capability_test));
    if (choice_.size() == subjects_.size()) return;
    add("<p>Drawn in full: the {} of {} tools and presets with most results. All others stand in "
        "the table above{}.</p>\n",
        choice_.size(), subjects_.size(),
        assessed_->strata.size() <= most_tables ? ", and with their numbers below" : "");
  }

  void add_subject(Subject subject) {
    const Stratum& first = *subject.front().stratum;
    const store::Tool& tool = study_->facts().tool(first.tool);
    const std::string preset =
        first.facts.preset ? fmt::format(", preset {}", *first.facts.preset) : std::string();
    add("<h2>{}{}</h2>\n<p class=\"quiet\">Serial {}{}</p>\n",
        escape(study_->facts().place(first.place).name), preset, escape(tool.name.serial),
        tool.model.empty() ? "" : ", model " + escape(tool.model));
    for (const Quantity quantity : work::quantities) {
      const std::string figure = run_figure(subject, quantity, *study_, zone());
      const bool zooms = is_interactive() && !figure.empty();
      out_ += zooms ? zooming(figure, run_chart_of(subject, quantity, *study_, zone())) : figure;
    }
    out_ += curve_figures(subject, *study_, facts_->curves);
    for (const AssessedStratum& each : subject) add_stratum(each, subject.size() > 1);
  }

  void add_stratum(const AssessedStratum& each, bool is_one_of_several) {
    const Stratum& stratum = *each.stratum;
    if (is_one_of_several) {
      const std::string why =
          stratum.change.empty() ? std::string() : ": " + escape(stratum.change);
      add("<h3>From {} to {}{}</h3>\n", zone().minute(stratum.results.front().at),
          zone().minute(stratum.results.back().at), why);
    }
    out_ += "<div class=\"figures\">\n";
    for (const Quantity quantity : work::quantities) {
      const std::string histogram = histogram_figure(each, quantity, *study_, zone());
      const std::string control = control_figure(each, quantity, *study_, zone());
      if (histogram.empty()) continue;
      add("<div>{}</div>\n", histogram);
      add("<div>{}</div>\n",
          control.empty() ? fmt::format("<p class=\"quiet\">No control chart of {}: {}.</p>\n",
                                        name_of(quantity),
                                        reasons_of(each.quantities[quantity], stratum, zone()))
                          : control);
    }
    out_ += "</div>\n" + numbers_table(each, *study_, zone());
  }

  void other_strata() {
    if (choice_.size() == subjects_.size() || assessed_->strata.size() > most_tables) return;
    out_ += "<h2>Other tools and presets</h2>\n";
    for (const Subject subject : subjects_) {
      if (choice_.has(subject)) continue;
      for (const AssessedStratum& each : subject) {
        const Stratum& stratum = *each.stratum;
        const std::string preset = stratum.facts.preset
                                       ? fmt::format(", preset {}", *stratum.facts.preset)
                                       : std::string();
        add("<h3>{}{}, from {}</h3>\n", escape(study_->facts().place(stratum.place).name), preset,
            zone().minute(stratum.results.front().at));
        out_ += numbers_table(each, *study_, zone());
      }
    }
  }

  void ng_results() {
    const std::vector<CodeRow> rows = code_rows(*assessed_);
    out_ += "<h2>NG results</h2>\n";
    if (rows.empty()) {
      out_ += "<p>There is none.</p>\n";
      return;
    }
    out_ += pareto_figure(rows) + codes_table(rows);
  }

  void left_out() {
    out_ += "<h2>What was left out, and why</h2>\n";
    std::string lines;
    for (const AssessedStratum& each : assessed_->strata) {
      const Stratum& stratum = *each.stratum;
      for (const std::string& line : left_out_of(stratum, study_->options())) {
        const std::string preset = stratum.facts.preset
                                       ? fmt::format(", preset {}", *stratum.facts.preset)
                                       : std::string();
        lines +=
            fmt::format("<li>{}{}: {}</li>\n", escape(study_->facts().place(stratum.place).name),
                        preset, escape(line));
      }
    }
    for (const work::Exclusion& exclusion : study_->exclusions()) {
      lines += fmt::format("<li>Excluded by hand: {}/{}/{} ({}), because: {}</li>\n",
                           escape(exclusion.serial), exclusion.epoch, exclusion.number,
                           exclusion.is_found ? escape(exclusion.value) : "not among these results",
                           escape(exclusion.reason));
    }
    lines += other_events();
    out_ += lines.empty() ? "<p>Nothing.</p>\n" : "<ul>\n" + lines + "</ul>\n";
  }

  /// What tools told beside results of fastenings.
  [[nodiscard]] std::string other_events() const {
    std::string lines;
    for (const work::StudiedTool* tool : study_->tools()) {
      std::string text;
      if (tool->loosenings > 0) text = counted(tool->loosenings, "loosening");
      for (const auto& [kind, count] : tool->others) {
        text += fmt::format("{}{} {}", text.empty() ? "" : ", ", kind, count);
      }
      if (text.empty()) continue;
      lines += fmt::format("<li>Serial {}: what is no fastening: {}</li>\n",
                           escape(study_->facts().tool(tool->tool).name.serial), escape(text));
    }
    return lines;
  }

  void how_computed() {
    out_ += "<h2>How this was computed</h2>\n<ul>\n";
    const auto item = [&](std::string_view text) { add("<li>{}</li>\n", escape(text)); };
    item(
        "Torque as the tool itself reports it. This is the performance of tool and joint "
        "together; it replaces neither a machine capability test by VDI/VDE 2645-2 (reference "
        "transducer) nor a process capability test by 2645-3 (residual torque).");
    item(
        "A stratum is one tool, preset, target, mode, limits, firmware and torque unit. Nothing "
        "is pooled over strata.");
    item(
        "Statistics hold OK results and NG results that came to their end: to leave out what the "
        "limits rejected would make every process look capable. What did not come to its end "
        "measured something else and is counted, not averaged. Which code means which is said "
        "above, with its evidence.");
    item(
        "Pp and Ppk are of s of all values, Cp and Cpk of s within (mean moving range / 1.128) "
        "and only where the control chart is stable; Ppk needs 30 values, and each index stands "
        "with its 95 % interval (Bissell 1990). Yield has the interval of Wilson.");
    add("<li>Stable means: no more signals than chance explains in 95 % of all cases. Rules: {}. "
        "Control limits come from the baseline that each chart names and are then kept. "
        "Neighbours are never formed across a gap, a restart, a change of settings or a pause of "
        "more than {}.</li>\n",
        rules_text(facts_->options.rules), to_text(facts_->options.shift_break));
    if (study_->options().include_not_completed) {
      item("As you asked, results that were not completed are in the statistics.");
    }
    item(limit_assumption);
    item(facts_->curves.empty()
             ? "Curves of torque over angle: none are stored."
             : "Curves are those that the tool sent, the newest 40 OK and 40 NG ones of each "
               "stratum; steps are those of the newest.");
    out_ += "</ul>\n";
  }

  static std::string_view rules_text(statistics::RuleSet rules) {
    switch (rules) {
      case statistics::RuleSet::atlas:
        return "1 (beyond 3 sigma) and 4 (7 in a row on one side)";
      case statistics::RuleSet::western_electric:
        return "1 (beyond 3 sigma) and 4 (8 in a row on one side) decide; 2 (2 of 3 beyond 2 "
               "sigma) and 3 (4 of 5 beyond 1 sigma) are shown";
      case statistics::RuleSet::standard:
        break;
    }
    return "1 (beyond 3 sigma) and 4 (8 in a row on one side)";
  }

  const Assessed* assessed_;
  const work::Study* study_;
  const PageFacts* facts_;
  std::vector<Subject> subjects_;
  Choice choice_;
  std::string out_ = {};
};

}  // namespace

std::string report_page(const Assessed& assessed, const PageFacts& facts) {
  return Page(assessed, facts).draw();
}

}  // namespace spindle::commands
