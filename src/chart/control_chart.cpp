#include "spindle/chart/control_chart.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "course.hpp"
#include "plot.hpp"
#include "spindle/base/text.hpp"
#include "text.hpp"

namespace spindle::chart {
namespace {

constexpr double room_at_ends = 0.1;
constexpr double tag_radius = 6.5;
// A run of signals by one rule has its number once in so many pixels.
constexpr double run_width = 40;
constexpr double between_panels = 26;

/// The points as the samples of a run chart.
std::vector<Sample> samples_of(const ControlPanel& panel, Along along) {
  std::vector<Sample> samples;
  samples.reserve(panel.points.size());
  for (const ControlPoint& point : panel.points) {
    samples.push_back(
        {.at = bounded_place(point.at, along), .value = point.value, .is_first = point.is_first});
  }
  return samples;
}

Extent extent_of(const ControlPanel& panel) {
  Extent extent;
  for (const ControlPoint& point : panel.points) extent.add(point.value);
  for (const Level& level : panel.levels) extent.add(level.value);
  return extent.padded(room_at_ends);
}

std::vector<const ControlPanel*> panels_of(const ControlChart& chart) {
  std::vector<const ControlPanel*> panels = {&chart.values};
  if (chart.variation) panels.push_back(&*chart.variation);
  return panels;
}

Span span_of(const ControlChart& chart) {
  Span span;
  const auto add = [&](std::int64_t at) { span.add(bounded_place(at, chart.course.along)); };
  for (const ControlPanel* panel : panels_of(chart)) {
    for (const ControlPoint& point : panel->points) add(point.at);
  }
  for (const Gap& gap : chart.gaps) {
    add(gap.from);
    add(gap.to);
  }
  for (const Change& change : chart.changes) add(change.at);
  return span;
}

/// Shapes at the points that signal, and the numbers of their rules where there is room.
class Signals {
 public:
  Signals(const ControlPanel& panel, Along along, const Scale& x, const Scale& y, const Box& box,
          std::size_t most)
      : panel_(panel), box_(box) {
    std::vector<Spot> spots;
    for (std::size_t at = 0; at < panel.points.size(); ++at) {
      const ControlPoint& point = panel.points[at];
      if (point.signal <= 0 || !std::isfinite(point.value)) continue;
      const double place = x(static_cast<double>(bounded_place(point.at, along)));
      spots.push_back({.x = place, .y = y(bounded(point.value)), .index = at});
    }
    spots_ = thinned(std::move(spots), most, box);
    for (const Level& level : panel.levels) {
      if (level.kind == LevelKind::mean) centre_ = y(bounded(level.value));
    }
  }

  void draw(Svg& svg, bool is_doubtful) const {
    Path shapes;
    for (const Spot& spot : spots_) draw_diamond(shapes, spot.x, spot.y);
    svg.path(is_doubtful ? Look::doubtful : Look::signal, shapes);
    const std::vector<Spot> tagged = tagged_spots();
    for (const Spot& spot : tagged) {
      svg.circle(is_doubtful ? Look::doubtful_tag : Look::signal_tag, spot.x, tag_y(spot),
                 tag_radius);
    }
    for (const Spot& spot : tagged) {
      svg.text(is_doubtful ? Look::doubtful_word : Look::signal_word, spot.x, tag_y(spot) + 3.6,
               Anchor::middle, fmt::format("{}", rule_of(spot)));
    }
  }

 private:
  [[nodiscard]] int rule_of(const Spot& spot) const {
    return std::min(panel_.points[spot.index].signal, 9);
  }

  /// Away from the centre line, but within the plot.
  [[nodiscard]] double tag_y(const Spot& spot) const {
    constexpr double away = 6 + tag_radius;
    const double y = spot.y > centre_ ? spot.y + away : spot.y - away;
    if (y < box_.top + tag_radius) return spot.y + away;
    if (y > box_.bottom - tag_radius) return spot.y - away;
    return y;
  }

  /// Those whose numbers do not cover each other.
  [[nodiscard]] std::vector<Spot> tagged_spots() const {
    std::vector<Spot> tagged;
    for (const Spot& spot : spots_) {
      const bool has_room = std::none_of(tagged.begin(), tagged.end(), [&](const Spot& before) {
        const double apart = std::hypot(spot.x - before.x, tag_y(spot) - tag_y(before));
        const bool is_same_run = rule_of(spot) == rule_of(before) && rule_of(spot) > 1;
        return apart < 2 * tag_radius + 1 || (is_same_run && spot.x - before.x < run_width);
      });
      if (has_room) tagged.push_back(spot);
    }
    return tagged;
  }

  const ControlPanel& panel_;
  Box box_;
  std::vector<Spot> spots_ = {};
  double centre_ = 0;
};

void draw_baseline(Svg& svg, const ControlChart& chart, const Scale& x, const Box& box) {
  if (!chart.baseline) return;
  const auto place = [&](std::int64_t at) {
    const double to = x(static_cast<double>(bounded_place(at, chart.course.along)));
    return std::clamp(to, box.left, box.right);
  };
  const double left = place(chart.baseline->from);
  const double right = std::max(place(chart.baseline->to), left + 1);
  svg.rectangle(Look::baseline,
                {.left = left, .top = box.top, .right = right, .bottom = box.bottom});
}

void draw_panel(Svg& svg, const ControlChart& chart, const ControlPanel& panel, const Scale& x,
                const Box& box, double name_y, const Sheet& sheet) {
  const Axis y = value_axis(extent_of(panel), panel.quantity, box);
  draw_baseline(svg, chart, x, box);
  draw_value_axis(svg, box, y, name_y);
  draw_samples(svg, samples_of(panel, chart.course.along), chart.gaps, x, y.scale);
  draw_blanks(svg, blanks_of(chart.gaps, chart.course, x), box);
  draw_changes(svg, chart.changes, chart.course, x, box);
  auto margin = draw_levels(svg, panel.levels, panel.quantity, chart.course, box, x, y.scale);
  Signals(panel, chart.course.along, x, y.scale, box, sheet.most_marks)
      .draw(svg, !chart.doubt.empty());
  draw_margin(svg, box, std::move(margin), sheet);
}

/// The left and right edge that suit all panels.
Box edges_of(const ControlChart& chart, const Sheet& sheet) {
  Box box{.right = sheet.width, .bottom = sheet.plot_height};
  for (const ControlPanel* panel : panels_of(chart)) {
    const Box height{.bottom = sheet.plot_height / 2};
    const Axis axis = value_axis(extent_of(*panel), panel->quantity, height);
    const Axis tall = value_axis(extent_of(*panel), panel->quantity, box);
    box.left = std::max({box.left, label_room(axis.ticks), label_room(tall.ticks)});
    const double margin = margin_room(level_words(panel->levels, panel->quantity), sheet);
    box.right = std::min(box.right, sheet.width - margin);
  }
  return box;
}

Legend legend_of(const ControlChart& chart, const Sheet& sheet, std::size_t dropped_words) {
  Legend legend;
  std::size_t finite = 0;
  std::map<int, std::size_t> signals;
  for (const ControlPoint& point : chart.values.points) {
    if (!std::isfinite(point.value)) continue;
    ++finite;
    if (point.signal > 0) ++signals[std::min(point.signal, 9)];
  }
  legend.add(Symbol::dots, counted(finite, "point"));
  if (const std::size_t all = chart.values.points.size(); finite < all) {
    legend.add(Symbol::none, fmt::format("{} without a value", grouped(all - finite)));
  }
  const Symbol shape = chart.doubt.empty() ? Symbol::diamond : Symbol::doubtful_diamond;
  for (const auto& [rule, count] : signals) {
    legend.add(shape, fmt::format("{} by rule {}", counted(count, "signal"), rule));
  }
  if (!chart.doubt.empty()) legend.add(Symbol::none, chart.doubt);
  if (chart.baseline) legend.add(Symbol::baseline, chart.baseline->word);
  if (!chart.gaps.empty()) legend.add(Symbol::hatch, missed_text(chart.gaps));
  if (dropped_words > 0) legend.add(Symbol::change, counted(chart.changes.size(), "change"));
  if (sheet.is_narrow) legend.add_origins(chart.values.levels);
  return legend;
}

}  // namespace

std::string control_chart(const ControlChart& chart, Format format) {
  const auto& points = chart.values.points;
  const bool has_values = std::any_of(points.begin(), points.end(), [](const ControlPoint& point) {
    return std::isfinite(point.value);
  });
  if (!has_values) return empty_figure(chart.caption, format, "no values");
  const Sheet sheet = sheet_of(format);
  const Span span = span_of(chart);
  Svg svg;
  const double top = draw_title(svg, chart.caption, sheet);
  Box box = edges_of(chart, sheet);
  const Axis x = course_axis(span.low, span.high, chart.course, box);
  TopWords words =
      top_words(chart.changes, blanks_of(chart.gaps, chart.course, x.scale), chart.course, x.scale);
  words.place(box.left, sheet);
  box.top = top + line_height + words.height() + 4;
  box.bottom = box.top + (chart.variation ? 0.8 : 1) * sheet.plot_height;
  draw_panel(svg, chart, chart.values, x.scale, box, top + letter_height - 2, sheet);
  words.draw(svg, box.top);
  if (chart.variation) {
    svg.line(Look::axis, box.left, box.bottom, box.right, box.bottom);
    box.top = box.bottom + between_panels;
    box.bottom = box.top + 0.5 * sheet.plot_height;
    draw_panel(svg, chart, *chart.variation, x.scale, box, box.top - 8, sheet);
  }
  const double below = draw_bottom_axis(svg, box, x, sheet);
  const Legend legend = legend_of(chart, sheet, words.dropped());
  const double bottom = legend.draw(svg, 8, sheet.width - 8, below);
  return finish(svg, sheet, bottom + 4, chart.caption, legend.facts());
}

}  // namespace spindle::chart
