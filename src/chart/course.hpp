#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "chart/plot.hpp"
#include "spindle/chart/figure.hpp"
#include "spindle/chart/run_chart.hpp"

/// What run charts and control charts share: values in their order, and what happened meanwhile.
namespace spindle::chart {

/// The good values of a column of pixels.
struct Column {
  double low = 0;
  double high = 0;
  double sum = 0;
  std::uint64_t count = 0;
};

/// One a pixel of the scale's width. Samples that are NG or not finite are left out.
std::vector<Column> columns_of(std::span<const Sample> samples, const Scale& x);

/// Where a mark is to be drawn.
struct Spot {
  double x;
  double y;
  std::size_t index;  ///< of what it marks
};

/// All of them up to `most`; else the first of each cell of so many pixels that no more are left.
std::vector<Spot> thinned(std::vector<Spot> spots, std::size_t most, const Box& box);

/// A place of a course that a chart can bear.
std::int64_t bounded_place(std::int64_t at, Along along);

/// The part of a course that a chart shows.
struct Span {
  std::int64_t low = 0;
  std::int64_t high = 0;
  bool is_empty = true;
  void add(std::int64_t at);
};

/// A gap in pixels; gaps that touch are one.
struct Blank {
  double left;
  double right;
  std::uint64_t missed;
};
std::vector<Blank> blanks_of(std::span<const Gap> gaps, const Course& course, const Scale& x);

enum class Drawn : std::uint8_t { line, band };

/// Draws the good samples: a line with dots, or a band with the mean of each column.
Drawn draw_samples(Svg& svg, std::span<const Sample> samples, std::span<const Gap> gaps,
                   const Scale& x, const Scale& y);

void draw_blanks(Svg& svg, std::span<const Blank> blanks, const Box& box);

/// Draws the lines and yields the words for the margin.
std::vector<MarginWord> draw_levels(Svg& svg, std::span<const Level> levels,
                                    const Quantity& quantity, const Course& course, const Box& box,
                                    const Scale& x, const Scale& y);
/// Those words before there is a scale, to make room for them.
std::vector<MarginWord> level_words(std::span<const Level> levels, const Quantity& quantity);

/// Words above the plot for changes and gaps, and vertical lines through `box` for the changes.
TopWords top_words(std::span<const Change> changes, std::span<const Blank> blanks,
                   const Course& course, const Scale& x);
void draw_changes(Svg& svg, std::span<const Change> changes, const Course& course, const Scale& x,
                  const Box& box);

/// "14 missed in 2 gaps".
std::string missed_text(std::span<const Gap> gaps);

}  // namespace spindle::chart
