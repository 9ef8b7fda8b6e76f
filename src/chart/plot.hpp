#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "chart/svg.hpp"
#include "spindle/chart/figure.hpp"
#include "spindle/chart/ticks.hpp"

/// What the charts share: scales, axes, lines across, words along the top, the legend.
namespace spindle::chart {

/// The measures of a format.
struct Sheet {
  bool is_narrow;
  double width;
  double plot_height;
  double widest_margin;  ///< for the words right of the plot
  /// More marks than these say nothing more, and make the file large.
  std::size_t most_marks;
};
Sheet sheet_of(Format format);

/// From a value to its place.
struct Scale {
  double low = 0;
  double high = 1;
  double begin = 0;
  double end = 1;
  [[nodiscard]] double operator()(double value) const;
  [[nodiscard]] bool holds(double value) const { return value >= low && value <= high; }
};

/// Finite, and no larger than what differences and squares of doubles bear.
double bounded(double value);

/// Grows with each finite value.
class Extent {
 public:
  void add(double value);
  [[nodiscard]] bool empty() const { return low_ > high_; }
  [[nodiscard]] double low() const { return low_; }
  [[nodiscard]] double high() const { return high_; }
  /// With some room at both ends, never empty.
  [[nodiscard]] Extent padded(double share) const;

 private:
  double low_ = 1;
  double high_ = 0;
};

/// The left edge, the bottom and what is marked there.
struct Axis {
  Scale scale;
  std::vector<Tick> ticks;
  std::string name;
};

Axis value_axis(const Extent& extent, const Quantity& quantity, const Box& box);
/// The same for quantities that lie along the bottom.
Axis bottom_axis(const Extent& extent, const Quantity& quantity, const Box& box);
Axis course_axis(std::int64_t low, std::int64_t high, const Course& course, const Box& box);

/// Room for the labels of a value axis; the same for every one whose labels are so.
double label_room(std::span<const Tick> ticks);

/// Its name stands at the left edge of the figure, at the height `name_y`.
void draw_value_axis(Svg& svg, const Box& box, const Axis& axis, double name_y);
/// The y below what it takes.
double draw_bottom_axis(Svg& svg, const Box& box, const Axis& axis, const Sheet& sheet);

Look line_look(LevelKind kind);
Look word_look(LevelKind kind);
/// "USL 2.98".
std::string level_text(const Level& level, const Quantity& quantity);

/// A word beside the plot at the height of what it names.
struct MarginWord {
  double y;
  Look look;
  std::string text;
  std::string detail = {};  ///< in a second line
};

/// What the words need right of the plot.
double margin_room(std::span<const MarginWord> words, const Sheet& sheet);
/// Moves words apart that would overlap, and draws them.
void draw_margin(Svg& svg, const Box& box, std::vector<MarginWord> words, const Sheet& sheet);

/// Words along the top of the plot, in as many rows as are needed to keep them apart.
class TopWords {
 public:
  void add(double x, Look look, std::string text);
  /// One that gives way where not all have room.
  void add_optional(double x, Look look, std::string text);
  /// Distributes what was added over rows.
  void place(double left, const Sheet& sheet);
  [[nodiscard]] double height() const;
  [[nodiscard]] std::size_t dropped() const { return dropped_; }
  /// Draws the words above `bottom`. A line leads from each to the plot.
  void draw(Svg& svg, double bottom) const;

 private:
  struct Word {
    double x;
    Look look;
    std::string text;
    std::size_t row = 0;
    bool is_optional = false;
    bool ends_at_x = false;
    bool is_dropped = false;
  };
  void distribute(double left, const Sheet& sheet);

  std::vector<Word> words_;
  std::size_t rows_ = 0;
  std::size_t dropped_ = 0;
};

enum class Symbol : std::uint8_t {
  none,
  dots,
  band,
  cross,
  arrow,
  hatch,
  change,
  baseline,
  bar,
  ng_bar,
  cause,
  normal,
  curve,
  ng_curve,
  diamond,
  doubtful_diamond,
  specification,
  control,
  target,
  mean,
};

/// What the shapes mean, in words, below the plot.
class Legend {
 public:
  void add(Symbol symbol, std::string text);
  /// The origins of levels, where the margin has no room for them.
  void add_origins(std::span<const Level> levels);
  /// The y below it.
  double draw(Svg& svg, double left, double right, double top) const;
  /// The entries as sentences.
  [[nodiscard]] std::string facts() const;

 private:
  struct Entry {
    Symbol symbol;
    std::string text;
  };
  std::vector<Entry> entries_;
};

void draw_cross(Path& path, double x, double y);
/// A triangle whose tip is at x, y.
void draw_arrow(Path& path, double x, double y, bool points_up);
void draw_diamond(Path& path, double x, double y);

/// The title at the top; the y below it.
double draw_title(Svg& svg, const Caption& caption, const Sheet& sheet);
std::string finish(const Svg& svg, const Sheet& sheet, double height, const Caption& caption,
                   std::string_view facts);
/// A figure that says why it shows nothing.
std::string empty_figure(const Caption& caption, Format format, const std::string& why);

}  // namespace spindle::chart
