#include "spindle/chart/curves.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "plot.hpp"
#include "spindle/base/text.hpp"
#include "text.hpp"

namespace spindle::chart {
namespace {

// What an eye does not see: points nearer to the line than this add nothing.
constexpr double tolerance = 0.2;
// More names than these do not fit beside the plot.
constexpr std::size_t most_names = 8;

bool is_drawable(const CurvePoint& point) {
  return std::isfinite(point.x) && std::isfinite(point.y);
}

bool is_empty(const Curve& curve) {
  return std::none_of(curve.points.begin(), curve.points.end(), is_drawable);
}

using Pixels = std::vector<CurvePoint>;

/// Of neighbours in the same column of pixels the first, the lowest, the highest and the last, in
/// their order: angles may run back.
Pixels by_columns(const Curve& curve, const Scale& x, const Scale& y) {
  Pixels pixels;
  Pixels column;
  const auto flush = [&] {
    const auto by_height = [](const CurvePoint& a, const CurvePoint& b) { return a.y < b.y; };
    auto [low, high] = std::minmax_element(column.begin(), column.end(), by_height);
    if (low > high) std::swap(low, high);
    for (auto point = column.begin(); point != column.end(); ++point) {
      const bool is_end = point == column.begin() || point + 1 == column.end();
      if (is_end || point == low || point == high) pixels.push_back(*point);
    }
    column.clear();
  };
  for (const CurvePoint& point : curve.points) {
    if (!is_drawable(point)) continue;
    const CurvePoint pixel{.x = x(bounded(point.x)), .y = y(bounded(point.y))};
    if (!column.empty() && std::floor(column.back().x) != std::floor(pixel.x)) flush();
    column.push_back(pixel);
  }
  flush();
  return pixels;
}

double distance(const CurvePoint& point, const CurvePoint& from, const CurvePoint& to) {
  const double dx = to.x - from.x;
  const double dy = to.y - from.y;
  const double square = dx * dx + dy * dy;
  const double along =
      square > 0
          ? std::clamp(((point.x - from.x) * dx + (point.y - from.y) * dy) / square, 0.0, 1.0)
          : 0;
  return std::hypot(point.x - from.x - along * dx, point.y - from.y - along * dy);
}

/// Without the points that lie on the line of their neighbours (Douglas and Peucker, 1973).
Pixels simplified(const Pixels& pixels) {
  if (pixels.size() < 3) return pixels;
  std::vector<bool> kept(pixels.size(), false);
  kept.front() = kept.back() = true;
  std::vector<std::pair<std::size_t, std::size_t>> open = {{0, pixels.size() - 1}};
  while (!open.empty()) {
    const auto [first, last] = open.back();
    open.pop_back();
    double farthest = tolerance;
    std::size_t index = first;
    for (std::size_t at = first + 1; at < last; ++at) {
      const double away = distance(pixels[at], pixels[first], pixels[last]);
      if (away <= farthest) continue;
      farthest = away;
      index = at;
    }
    if (index == first) continue;
    kept[index] = true;
    open.emplace_back(first, index);
    open.emplace_back(index, last);
  }
  Pixels left;
  for (std::size_t at = 0; at < pixels.size(); ++at) {
    if (kept[at]) left.push_back(pixels[at]);
  }
  return left;
}

void draw_curve(Svg& svg, Look look, const Pixels& pixels) {
  Path path;
  if (pixels.size() == 1) path.dot(pixels.front().x, pixels.front().y);
  for (std::size_t at = 0; at < pixels.size() && pixels.size() > 1; ++at) {
    if (at == 0) {
      path.move(pixels[at].x, pixels[at].y);
    } else {
      path.line(pixels[at].x, pixels[at].y);
    }
  }
  svg.path(look, path);
}

/// The NG curves that have a name, while there is room for it.
std::vector<const Curve*> named_curves(const Curves& chart) {
  std::vector<const Curve*> named;
  for (const Curve& curve : chart.curves) {
    if (curve.is_ng && !curve.name.empty() && !is_empty(curve)) named.push_back(&curve);
  }
  if (named.size() > most_names) named.clear();
  return named;
}

std::vector<MarginWord> margin_words(const Curves& chart, const Scale& y) {
  std::vector<MarginWord> words;
  for (const Level& level : chart.levels) {
    if (!std::isfinite(level.value)) continue;
    words.push_back({.y = y(bounded(level.value)),
                     .look = word_look(level.kind),
                     .text = level_text(level, chart.y),
                     .detail = level.origin});
  }
  for (const Curve* curve : named_curves(chart)) {
    const auto last = std::find_if(curve->points.rbegin(), curve->points.rend(), is_drawable);
    words.push_back({.y = y(bounded(last->y)), .look = Look::ng_word, .text = "NG " + curve->name});
  }
  return words;
}

/// From the end of each named curve to the margin.
void draw_leaders(Svg& svg, const Curves& chart, const Scale& x, const Scale& y, const Box& box) {
  Path leaders;
  for (const Curve* curve : named_curves(chart)) {
    const auto last = std::find_if(curve->points.rbegin(), curve->points.rend(), is_drawable);
    leaders.move(x(bounded(last->x)), y(bounded(last->y)));
    leaders.line(box.right, y(bounded(last->y)));
  }
  svg.path(Look::axis, leaders);
}

struct Extents {
  Extent x;
  Extent y;
};

Extents extents_of(const Curves& chart) {
  Extents extents;
  for (const Curve& curve : chart.curves) {
    for (const CurvePoint& point : curve.points) {
      if (!is_drawable(point)) continue;
      extents.x.add(point.x);
      extents.y.add(point.y);
    }
  }
  for (const Level& level : chart.levels) extents.y.add(level.value);
  return {.x = extents.x.padded(0.01), .y = extents.y.padded(0.05)};
}

void draw_curves(Svg& svg, const Curves& chart, const Scale& x, const Scale& y) {
  for (const bool is_ng : {false, true}) {
    for (const Curve& curve : chart.curves) {
      if (curve.is_ng != is_ng || is_empty(curve)) continue;
      draw_curve(svg, is_ng ? Look::ng_curve : Look::curve, simplified(by_columns(curve, x, y)));
    }
  }
}

Legend legend_of(const Curves& chart, const Sheet& sheet) {
  std::size_t good = 0;
  std::size_t ng = 0;
  std::size_t empty = 0;
  for (const Curve& curve : chart.curves) ++(is_empty(curve) ? empty : curve.is_ng ? ng : good);
  Legend legend;
  if (good > 0) legend.add(Symbol::curve, fmt::format("{} OK", grouped(good)));
  if (ng > 0) legend.add(Symbol::ng_curve, fmt::format("{} NG", grouped(ng)));
  if (empty > 0) legend.add(Symbol::none, counted(empty, "curve") + " without points");
  if (sheet.is_narrow) legend.add_origins(chart.levels);
  return legend;
}

}  // namespace

std::string curves(const Curves& chart, Format format) {
  if (std::all_of(chart.curves.begin(), chart.curves.end(), is_empty)) {
    return empty_figure(chart.caption, format, "no values");
  }
  const Sheet sheet = sheet_of(format);
  const Extents extents = extents_of(chart);
  Svg svg;
  const double top = draw_title(svg, chart.caption, sheet);
  Box box{.bottom = sheet.plot_height};
  const Axis unplaced = value_axis(extents.y, chart.y, box);
  box.left = label_room(unplaced.ticks);
  box.right = sheet.width - margin_room(margin_words(chart, unplaced.scale), sheet);
  const Axis x = bottom_axis(extents.x, chart.x, box);
  TopWords words;
  for (const StepMark& step : chart.steps) {
    if (std::isfinite(step.at) && x.scale.holds(step.at)) {
      words.add(x.scale(step.at), Look::change_word, step.word);
    }
  }
  words.place(box.left, sheet);
  box.top = top + line_height + words.height() + 4;
  box.bottom = box.top + sheet.plot_height;
  const Axis y = value_axis(extents.y, chart.y, box);
  draw_value_axis(svg, box, y, top + letter_height - 2);
  for (const StepMark& step : chart.steps) {
    if (!std::isfinite(step.at) || !x.scale.holds(step.at)) continue;
    svg.line(Look::change, x.scale(step.at), box.top, x.scale(step.at), box.bottom);
  }
  for (const Level& level : chart.levels) {
    if (!std::isfinite(level.value)) continue;
    const double height = y.scale(bounded(level.value));
    svg.line(line_look(level.kind), box.left, height, box.right, height);
  }
  draw_leaders(svg, chart, x.scale, y.scale, box);
  draw_curves(svg, chart, x.scale, y.scale);
  words.draw(svg, box.top);
  draw_margin(svg, box, margin_words(chart, y.scale), sheet);
  const double below = draw_bottom_axis(svg, box, x, sheet);
  const Legend legend = legend_of(chart, sheet);
  const double bottom = legend.draw(svg, 8, sheet.width - 8, below);
  return finish(svg, sheet, bottom + 4, chart.caption, legend.facts());
}

}  // namespace spindle::chart
