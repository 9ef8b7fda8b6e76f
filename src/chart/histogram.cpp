#include "spindle/chart/histogram.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "plot.hpp"
#include "text.hpp"

namespace spindle::chart {
namespace {

/// The classes in terms of the quantity.
class Edges {
 public:
  explicit Edges(const Histogram& chart) {
    const double step = std::isfinite(chart.step) && chart.step > 0 ? bounded(chart.step) : 1;
    width_ = bounded(step * static_cast<double>(std::max<std::int64_t>(chart.steps_per_class, 1)));
    first_ = bounded((static_cast<double>(chart.first) - 0.5) * step);
  }
  /// The lower edge of the class with this index.
  [[nodiscard]] double operator()(std::size_t index) const {
    return bounded(first_ + width_ * static_cast<double>(index));
  }
  [[nodiscard]] double width() const { return width_; }

 private:
  double width_ = 1;
  double first_ = 0;
};

std::uint64_t values_of(const Histogram& chart) {
  std::uint64_t count = chart.below + chart.above;
  for (const HistogramClass& each : chart.classes) count += each.count;
  return count;
}

/// The expected count of a class around the value.
double expected(const Histogram& chart, const Edges& edges, double value) {
  const double distance = (value - chart.normal->mean) / chart.normal->deviation;
  return static_cast<double>(values_of(chart)) * edges.width() *
         std::exp(-distance * distance / 2) /
         (chart.normal->deviation * std::sqrt(2 * std::numbers::pi));
}

bool has_curve(const Histogram& chart) {
  return chart.normal && std::isfinite(chart.normal->mean) &&
         std::isfinite(chart.normal->deviation) && chart.normal->deviation > 0;
}

Extent values_extent(const Histogram& chart, const Edges& edges) {
  Extent extent;
  extent.add(edges(0));
  extent.add(edges(chart.classes.size()));
  for (const Level& level : chart.levels) extent.add(level.value);
  return extent.padded(0.03);
}

double highest_count(const Histogram& chart, const Edges& edges) {
  double highest = 1;
  for (const HistogramClass& each : chart.classes) {
    highest = std::max(highest, static_cast<double>(each.count));
  }
  // A curve far narrower than a class must not make the bars vanish.
  if (has_curve(chart)) {
    highest = std::max(highest, std::min(expected(chart, edges, chart.normal->mean), 3 * highest));
  }
  return highest * 1.08;
}

void draw_bars(Svg& svg, const Histogram& chart, const Edges& edges, const Scale& x,
               const Scale& y) {
  constexpr double widest_gap = 1;
  for (std::size_t at = 0; at < chart.classes.size(); ++at) {
    const HistogramClass& each = chart.classes[at];
    if (each.count == 0) continue;
    const double left = x(edges(at));
    const double right = x(edges(at + 1));
    const double gap = std::min(widest_gap, (right - left) / 8);
    svg.rectangle(Look::bar, {.left = left + gap,
                              .top = y(static_cast<double>(each.count)),
                              .right = right - gap,
                              .bottom = y(0)});
  }
  Path hatch;
  for (std::size_t at = 0; at < chart.classes.size(); ++at) {
    const HistogramClass& each = chart.classes[at];
    const std::uint64_t ng = std::min(each.ng, each.count);
    if (ng == 0) continue;
    const Box part{.left = x(edges(at)) + 1,
                   .top = y(static_cast<double>(ng)),
                   .right = std::max(x(edges(at + 1)) - 1, x(edges(at)) + 2),
                   .bottom = y(0)};
    svg.rectangle(Look::ng_bar, part);
    const Path lines = hatching(part, 5);
    svg.path(Look::ng, lines);
  }
}

void draw_counts(Svg& svg, const Histogram& chart, const Edges& edges, const Scale& x,
                 const Scale& y) {
  // All or none: a missing number would look like an empty class.
  const double room = x(edges(1)) - x(edges(0));
  if (std::any_of(chart.classes.begin(), chart.classes.end(), [&](const HistogramClass& each) {
        return text_width(grouped(each.count)) > room;
      })) {
    return;
  }
  for (std::size_t at = 0; at < chart.classes.size(); ++at) {
    const std::uint64_t count = chart.classes[at].count;
    const std::string text = grouped(count);
    if (count == 0) continue;
    svg.text(Look::plot_word, (x(edges(at)) + x(edges(at + 1))) / 2,
             y(static_cast<double>(count)) - 4, Anchor::middle, text);
  }
}

void draw_normal(Svg& svg, const Histogram& chart, const Edges& edges, const Scale& x,
                 const Scale& y) {
  if (!has_curve(chart)) return;
  constexpr int points = 160;
  constexpr double deviations = 4;
  Path curve;
  for (int at = 0; at <= points; ++at) {
    const double value =
        chart.normal->mean + chart.normal->deviation * deviations * (2.0 * at / points - 1);
    if (!x.holds(value)) continue;
    const double height = std::max(y(expected(chart, edges, value)), y.end);
    if (curve.empty()) {
      curve.move(x(value), height);
    } else {
      curve.line(x(value), height);
    }
  }
  svg.path(Look::normal, curve);
}

Legend legend_of(const Histogram& chart) {
  Legend legend;
  std::uint64_t ng = 0;
  for (const HistogramClass& each : chart.classes) ng += std::min(each.ng, each.count);
  const int decimals = chart.quantity.decimals;
  const double width =
      chart.step * static_cast<double>(std::max<std::int64_t>(chart.steps_per_class, 1));
  legend.add(Symbol::bar, fmt::format("{} values, classes of {}{}{}", grouped(values_of(chart)),
                                      number_text(width, decimals),
                                      chart.quantity.unit.empty() ? "" : " ", chart.quantity.unit));
  if (ng > 0) legend.add(Symbol::ng_bar, fmt::format("of these {} NG", grouped(ng)));
  if (chart.below > 0) {
    legend.add(Symbol::none, fmt::format("{} more below", grouped(chart.below)));
  }
  if (chart.above > 0) {
    legend.add(Symbol::none, fmt::format("{} more above", grouped(chart.above)));
  }
  if (has_curve(chart)) {
    legend.add(Symbol::normal, fmt::format("normal curve: mean {}, s {}",
                                           number_text(chart.normal->mean, decimals + 1),
                                           number_text(chart.normal->deviation, decimals + 2)));
  }
  legend.add_origins(chart.levels);
  return legend;
}

/// Vertical lines for the levels, and their words.
TopWords level_top_words(const Histogram& chart, const Scale& x) {
  TopWords words;
  for (const Level& level : chart.levels) {
    if (!std::isfinite(level.value)) continue;
    words.add(x(bounded(level.value)), word_look(level.kind), level_text(level, chart.quantity));
  }
  return words;
}

void draw_level_lines(Svg& svg, const Histogram& chart, const Scale& x, const Box& box) {
  for (const Level& level : chart.levels) {
    if (!std::isfinite(level.value)) continue;
    const double place = x(bounded(level.value));
    svg.line(line_look(level.kind), place, box.top, place, box.bottom);
  }
}

}  // namespace

std::string histogram(const Histogram& chart, Format format) {
  if (values_of(chart) == 0) return empty_figure(chart.caption, format, "no values");
  const Sheet sheet = sheet_of(format);
  const Edges edges(chart);
  Svg svg;
  const double top = draw_title(svg, chart.caption, sheet);
  const double highest = highest_count(chart, edges);
  Box box{.right = sheet.width - 16, .bottom = sheet.plot_height};
  const auto count_axis = [&](const Box& in) -> Axis {
    const int most = std::max(2, static_cast<int>(in.height() / 38));
    return {.scale = {.low = 0, .high = highest, .begin = in.bottom, .end = in.top},
            .ticks = number_ticks(0, highest, most, 1),
            .name = "Values in a class"};
  };
  box.left = label_room(count_axis(box).ticks);
  const Axis x = bottom_axis(values_extent(chart, edges), chart.quantity, box);
  TopWords words = level_top_words(chart, x.scale);
  words.place(box.left, sheet);
  box.top = top + line_height + words.height() + 4;
  box.bottom = box.top + sheet.plot_height;
  const Axis y = count_axis(box);
  draw_value_axis(svg, box, y, top + letter_height - 2);
  draw_bars(svg, chart, edges, x.scale, y.scale);
  draw_normal(svg, chart, edges, x.scale, y.scale);
  draw_level_lines(svg, chart, x.scale, box);
  draw_counts(svg, chart, edges, x.scale, y.scale);
  words.draw(svg, box.top);
  const double below = draw_bottom_axis(svg, box, x, sheet);
  const Legend legend = legend_of(chart);
  const double bottom = legend.draw(svg, 8, sheet.width - 8, below);
  return finish(svg, sheet, bottom + 4, chart.caption, legend.facts());
}

}  // namespace spindle::chart
