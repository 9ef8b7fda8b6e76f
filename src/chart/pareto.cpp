#include "spindle/chart/pareto.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "plot.hpp"
#include "text.hpp"

namespace spindle::chart {
namespace {

constexpr std::size_t most_bars = 12;
constexpr double bar_height = 15;

/// The most frequent cause first; the rare ones as one, last.
std::vector<Cause> ordered(const Pareto& chart) {
  std::vector<Cause> causes = chart.causes;
  std::erase_if(causes, [](const Cause& cause) { return cause.count == 0; });
  std::stable_sort(causes.begin(), causes.end(), [](const Cause& a, const Cause& b) {
    return a.count != b.count ? a.count > b.count : a.code < b.code;
  });
  if (causes.size() <= most_bars) return causes;
  Cause rest{.code = fmt::format("{} other codes", causes.size() - most_bars + 1),
             .label = {},
             .count = 0};
  for (std::size_t at = most_bars - 1; at < causes.size(); ++at) rest.count += causes[at].count;
  causes.resize(most_bars - 1);
  causes.push_back(std::move(rest));
  return causes;
}

std::string name_of(const Cause& cause) {
  return cause.label.empty() ? cause.code : fmt::format("{}  {}", cause.code, cause.label);
}

std::string percent(std::uint64_t part, std::uint64_t all) {
  return fmt::format("{:.1f}", 100 * static_cast<double>(part) / static_cast<double>(all));
}

/// Where the rows are.
struct Rows {
  Box box;
  double apart;
  bool has_names_above;
  /// The middle of a bar.
  [[nodiscard]] double middle(std::size_t row) const {
    return box.top + static_cast<double>(row) * apart +
           (has_names_above ? apart - bar_height / 2 - 3 : apart / 2);
  }
};

Rows rows_of(const std::vector<Cause>& causes, const Sheet& sheet, double top) {
  Rows rows{.box = {}, .apart = sheet.is_narrow ? 37.0 : 26.0, .has_names_above = sheet.is_narrow};
  double names = 60;
  for (const Cause& cause : causes) names = std::max(names, text_width(name_of(cause)));
  rows.box.left = sheet.is_narrow ? 8 : std::min(names, 300.0) + 18;
  // The count behind the bar of a cause that is nearly alone.
  rows.box.right = sheet.width - 24;
  rows.box.top = top + 22;
  rows.box.bottom = rows.box.top + static_cast<double>(causes.size()) * rows.apart;
  return rows;
}

void draw_scale(Svg& svg, const Box& box, const Scale& x) {
  Path grid;
  for (int share = 0; share <= 100; share += 20) {
    grid.move(x(share), box.top);
    grid.line(x(share), box.bottom);
  }
  svg.path(Look::grid, grid);
  svg.line(Look::axis, box.left, box.top, box.left, box.bottom);
  for (int share = 0; share <= 100; share += 20) {
    const Anchor anchor = share == 0 ? Anchor::start : Anchor::middle;
    svg.text(Look::quiet, x(share), box.top - 6, anchor, fmt::format("{} %", share));
  }
}

/// Behind the bar, or in front of the end of the line where it would be drawn over.
void draw_rows(Svg& svg, const std::vector<Cause>& causes, const Rows& rows, const Scale& x,
               std::uint64_t all) {
  for (std::size_t row = 0; row < causes.size(); ++row) {
    const double y = rows.middle(row);
    const double end = x(100 * static_cast<double>(causes[row].count) / static_cast<double>(all));
    svg.rectangle(Look::ng_bar, {.left = rows.box.left,
                                 .top = y - bar_height / 2,
                                 .right = std::max(end, rows.box.left + 1),
                                 .bottom = y + bar_height / 2});
  }
  for (std::size_t row = 0; row < causes.size(); ++row) {
    const std::string name = name_of(causes[row]);
    const double y = rows.middle(row);
    if (rows.has_names_above) {
      svg.text(Look::word, rows.box.left + 2, y - bar_height / 2 - 4, Anchor::start,
               shortened(name, rows.box.width()));
    } else {
      svg.text(Look::word, rows.box.left - 8, y + 4, Anchor::end,
               shortened(name, rows.box.left - 16));
    }
  }
}

void draw_counts(Svg& svg, const std::vector<Cause>& causes, const Rows& rows, const Scale& x,
                 std::uint64_t all) {
  std::uint64_t before = 0;
  for (std::size_t row = 0; row < causes.size(); ++row) {
    const std::uint64_t count = causes[row].count;
    const double y = rows.middle(row) + 4;
    const double end = x(100 * static_cast<double>(count) / static_cast<double>(all));
    const std::string text = fmt::format("{} ({} %)", grouped(count), percent(count, all));
    before += count;
    const double mark = x(100 * static_cast<double>(before) / static_cast<double>(all));
    const double width = text_width(text) + 10;
    const bool is_covered = end + width > mark - 8 && end < mark + 8;
    if (is_covered && end - width > rows.box.left) {
      svg.text(Look::ng_word, end - 10, y, Anchor::end, text);
    } else if (is_covered) {
      svg.text(Look::ng_word, mark + 10, y, Anchor::start, text);
    } else {
      svg.text(Look::ng_word, end + 6, y, Anchor::start, text);
    }
  }
}

/// Through the end of each row, where it has reached.
void draw_cumulated(Svg& svg, const std::vector<Cause>& causes, const Rows& rows, const Scale& x,
                    std::uint64_t all) {
  Path line;
  Path dots;
  std::uint64_t count = 0;
  for (std::size_t row = 0; row < causes.size(); ++row) {
    count += causes[row].count;
    const double place = x(100 * static_cast<double>(count) / static_cast<double>(all));
    if (row == 0) {
      line.move(place, rows.middle(row));
    } else {
      line.line(place, rows.middle(row));
    }
    dots.dot(place, rows.middle(row));
  }
  svg.path(Look::course, line);
  svg.path(Look::dots, dots);
}

}  // namespace

std::string pareto(const Pareto& chart, Format format) {
  const std::vector<Cause> causes = ordered(chart);
  if (causes.empty()) return empty_figure(chart.caption, format, "no values");
  std::uint64_t all = 0;
  for (const Cause& cause : causes) all += cause.count;
  const Sheet sheet = sheet_of(format);
  Svg svg;
  const double top = draw_title(svg, chart.caption, sheet);
  const Rows rows = rows_of(causes, sheet, top);
  const Scale x{.low = 0, .high = 100, .begin = rows.box.left, .end = rows.box.right};
  draw_scale(svg, rows.box, x);
  draw_rows(svg, causes, rows, x, all);
  draw_cumulated(svg, causes, rows, x, all);
  draw_counts(svg, causes, rows, x, all);
  Legend legend;
  legend.add(Symbol::cause, fmt::format("100 % = {} {}", grouped(all), chart.counted));
  legend.add(Symbol::dots, "cumulated");
  std::string facts = legend.facts();
  for (const Cause& cause : causes) {
    facts += fmt::format(" {}: {}.", shortened(name_of(cause), 4000), cause.count);
  }
  const double bottom = legend.draw(svg, 8, sheet.width - 8, rows.box.bottom + 6);
  return finish(svg, sheet, bottom + 4, chart.caption, facts);
}

}  // namespace spindle::chart
