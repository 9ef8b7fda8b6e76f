#include "spindle/chart/run_chart.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "course.hpp"
#include "plot.hpp"
#include "spindle/base/text.hpp"
#include "text.hpp"

namespace spindle::chart {
namespace {

constexpr double room_at_ends = 0.06;

/// What the samples are, before anything is drawn.
struct Survey {
  std::size_t good = 0;
  std::size_t ng = 0;
  std::size_t without_value = 0;
  Span span;
  Extent extent;  ///< of the good values and the levels; of the NG ones where there are no others
};

/// Makes room for NG values just outside: how far they missed is worth seeing.
void add_near_ng(Extent& extent, std::span<const Sample> samples) {
  constexpr double share = 0.15;
  if (extent.empty()) return;
  const double room = (extent.high() - extent.low()) * share;
  const double low = extent.low() - room;
  const double high = extent.high() + room;
  for (const Sample& sample : samples) {
    if (sample.is_ng && sample.value >= low && sample.value <= high) extent.add(sample.value);
  }
}

Survey survey_of(const RunChart& chart) {
  Survey survey;
  Extent of_ng;
  const Along along = chart.course.along;
  for (const Sample& sample : chart.samples) {
    survey.span.add(bounded_place(sample.at, along));
    if (std::isnan(sample.value) || (!sample.is_ng && !std::isfinite(sample.value))) {
      ++survey.without_value;
    } else if (sample.is_ng) {
      ++survey.ng;
      of_ng.add(sample.value);
    } else {
      ++survey.good;
      survey.extent.add(sample.value);
    }
  }
  for (const Level& level : chart.levels) survey.extent.add(level.value);
  if (survey.extent.empty()) survey.extent = of_ng;
  add_near_ng(survey.extent, chart.samples);
  if (survey.span.is_empty) return survey;
  for (const Gap& gap : chart.gaps) {
    survey.span.add(bounded_place(gap.from, along));
    survey.span.add(bounded_place(gap.to, along));
  }
  for (const Change& change : chart.changes) survey.span.add(bounded_place(change.at, along));
  return survey;
}

/// The marks of NG results, apart by whether they lie on the scale.
struct NgMarks {
  std::vector<Spot> spots;
  std::size_t inside = 0;
  std::size_t outside = 0;
  bool is_thinned = false;
};

NgMarks ng_marks(std::span<const Sample> samples, const Scale& x, const Scale& y, const Box& box,
                 std::size_t most) {
  NgMarks marks;
  for (std::size_t at = 0; at < samples.size(); ++at) {
    const Sample& sample = samples[at];
    if (!sample.is_ng || std::isnan(sample.value)) continue;
    ++(y.holds(sample.value) ? marks.inside : marks.outside);
    const double height = std::clamp(y(bounded(sample.value)), box.top, box.bottom);
    marks.spots.push_back({.x = x(static_cast<double>(sample.at)), .y = height, .index = at});
  }
  const std::size_t all = marks.spots.size();
  marks.spots = thinned(std::move(marks.spots), most, box);
  marks.is_thinned = marks.spots.size() < all;
  return marks;
}

void draw_ng(Svg& svg, const NgMarks& marks, std::span<const Sample> samples, const Scale& y) {
  Path crosses;
  Path arrows;
  for (const Spot& spot : marks.spots) {
    const double value = samples[spot.index].value;
    if (y.holds(value)) {
      draw_cross(crosses, spot.x, spot.y);
    } else {
      draw_arrow(arrows, spot.x, spot.y, value > y.high);
    }
  }
  svg.path(Look::ng, crosses);
  svg.path(Look::ng_shape, arrows);
}

Legend legend_of(const RunChart& chart, const Survey& survey, const NgMarks& marks, Drawn drawn,
                 const Sheet& sheet, std::size_t dropped_words) {
  Legend legend;
  if (drawn == Drawn::line && survey.good > 0) {
    legend.add(Symbol::dots, fmt::format("{} OK", grouped(survey.good)));
  }
  if (drawn == Drawn::band) {
    legend.add(Symbol::band, fmt::format("{} OK: range and mean a column", grouped(survey.good)));
  }
  const std::string_view several = marks.is_thinned ? ", not each drawn" : "";
  if (marks.inside > 0) {
    legend.add(Symbol::cross, fmt::format("{} NG{}", grouped(marks.inside), several));
  }
  if (marks.outside > 0) {
    legend.add(Symbol::arrow,
               fmt::format("{} NG outside the scale{}", grouped(marks.outside), several));
  }
  if (survey.without_value > 0) {
    legend.add(Symbol::none, fmt::format("{} without a value", grouped(survey.without_value)));
  }
  if (!chart.gaps.empty()) legend.add(Symbol::hatch, missed_text(chart.gaps));
  if (dropped_words > 0) {
    legend.add(Symbol::change, counted(chart.changes.size(), "change"));
  }
  if (sheet.is_narrow) legend.add_origins(chart.levels);
  return legend;
}

std::string nothing_to_draw(const RunChart& chart, const Survey& survey) {
  std::string why = "no values";
  if (survey.without_value > 0) {
    why += fmt::format("; {} without a value", grouped(survey.without_value));
  }
  if (!chart.gaps.empty()) why += "; " + missed_text(chart.gaps);
  return why;
}

/// Samples whose place a chart can bear, or none where all are so already.
std::vector<Sample> placed(const RunChart& chart) {
  const auto is_placed = [&](const Sample& sample) {
    return sample.at == bounded_place(sample.at, chart.course.along);
  };
  if (std::all_of(chart.samples.begin(), chart.samples.end(), is_placed)) return {};
  std::vector<Sample> samples = chart.samples;
  for (Sample& sample : samples) sample.at = bounded_place(sample.at, chart.course.along);
  return samples;
}

/// The range of what was drawn, for those who do not see it.
std::string range_facts(const RunChart& chart, const Survey& survey) {
  if (chart.course.along == Along::index) return {};
  const int offset = chart.course.utc_offset_minutes;
  return fmt::format("From {} to {}. ", time_text(survey.span.low, offset),
                     time_text(survey.span.high, offset));
}

}  // namespace

std::string run_chart(const RunChart& chart, Format format) {
  const Survey survey = survey_of(chart);
  if (survey.good + survey.ng == 0) {
    return empty_figure(chart.caption, format, nothing_to_draw(chart, survey));
  }
  const std::vector<Sample> moved = placed(chart);
  const std::span<const Sample> samples = moved.empty() ? chart.samples : moved;
  const Sheet sheet = sheet_of(format);
  const Extent extent = survey.extent.padded(room_at_ends);
  Svg svg;
  const double top = draw_title(svg, chart.caption, sheet);

  Box box{.bottom = sheet.plot_height};
  box.left = label_room(value_axis(extent, chart.quantity, box).ticks);
  box.right = sheet.width - margin_room(level_words(chart.levels, chart.quantity), sheet);
  const Axis x = course_axis(survey.span.low, survey.span.high, chart.course, box);
  const std::vector<Blank> blanks = blanks_of(chart.gaps, chart.course, x.scale);
  TopWords words = top_words(chart.changes, blanks, chart.course, x.scale);
  words.place(box.left, sheet);
  box.top = top + line_height + words.height() + 4;
  box.bottom = box.top + sheet.plot_height;
  const Axis y = value_axis(extent, chart.quantity, box);

  draw_value_axis(svg, box, y, top + letter_height - 2);
  const Drawn drawn = draw_samples(svg, samples, chart.gaps, x.scale, y.scale);
  draw_blanks(svg, blanks, box);
  draw_changes(svg, chart.changes, chart.course, x.scale, box);
  auto margin = draw_levels(svg, chart.levels, chart.quantity, chart.course, box, x.scale, y.scale);
  const NgMarks marks = ng_marks(samples, x.scale, y.scale, box, sheet.most_marks);
  draw_ng(svg, marks, samples, y.scale);
  words.draw(svg, box.top);
  draw_margin(svg, box, std::move(margin), sheet);
  const double below = draw_bottom_axis(svg, box, x, sheet);
  const Legend legend = legend_of(chart, survey, marks, drawn, sheet, words.dropped());
  const double bottom = legend.draw(svg, 8, sheet.width - 8, below);
  return finish(svg, sheet, bottom + 4, chart.caption, range_facts(chart, survey) + legend.facts());
}

std::string small_run_chart(const RunChart& chart) {
  constexpr Box sheet{.right = 180, .bottom = 36};
  constexpr std::size_t most_small_marks = 40;
  constexpr Box box{.left = 4, .top = 4, .right = 176, .bottom = 32};
  Svg svg;
  const Survey survey = survey_of(chart);
  if (survey.good + survey.ng == 0) {
    svg.text(Look::quiet, 90, 22, Anchor::middle, "no values");
    return svg.finish("chart-small", sheet.right, sheet.bottom, chart.caption,
                      nothing_to_draw(chart, survey) + ".");
  }
  const std::vector<Sample> moved = placed(chart);
  const std::span<const Sample> samples = moved.empty() ? chart.samples : moved;
  const Axis x = course_axis(survey.span.low, survey.span.high, chart.course, box);
  const Axis y = value_axis(survey.extent.padded(room_at_ends), chart.quantity, box);
  const Drawn drawn = draw_samples(svg, samples, chart.gaps, x.scale, y.scale);
  draw_blanks(svg, blanks_of(chart.gaps, chart.course, x.scale), box);
  draw_changes(svg, chart.changes, chart.course, x.scale, box);
  draw_levels(svg, chart.levels, chart.quantity, chart.course, box, x.scale, y.scale);
  const NgMarks marks = ng_marks(samples, x.scale, y.scale, box, most_small_marks);
  draw_ng(svg, marks, samples, y.scale);
  const Legend legend = legend_of(chart, survey, marks, drawn, sheet_of(Format::wide), 0);
  return svg.finish("chart-small", sheet.right, sheet.bottom, chart.caption, legend.facts());
}

}  // namespace spindle::chart
