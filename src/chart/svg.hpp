#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "spindle/chart/figure.hpp"

namespace spindle::chart {

struct Box {
  double left = 0;
  double top = 0;
  double right = 0;
  double bottom = 0;
  [[nodiscard]] double width() const { return right - left; }
  [[nodiscard]] double height() const { return bottom - top; }
};

/// How a part is drawn. Each is a class for the style of a page, with the same look as attributes,
/// so that a figure is readable without it.
enum class Look : std::uint8_t {
  title,
  word,
  plot_word,
  quiet,
  grid,
  axis,
  band,
  course,
  dots,
  small_dots,
  ng,
  ng_shape,
  ng_word,
  specification,
  specification_word,
  control,
  control_word,
  target,
  target_word,
  mean,
  mean_word,
  change,
  change_word,
  gap,
  hatch,
  baseline,
  bar,
  ng_bar,
  normal,
  curve,
  ng_curve,
  signal,
  signal_tag,
  signal_word,
  doubtful,
  doubtful_tag,
  doubtful_word,
};

/// The data of a <path>, in tenths of a pixel and relative, which is short.
class Path {
 public:
  void move(double x, double y);
  void line(double x, double y);
  void close();
  /// A line of no length: a dot where line ends are round.
  void dot(double x, double y);
  [[nodiscard]] bool empty() const { return text_.empty(); }
  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  void put(char command, std::initializer_list<int> numbers);

  std::string text_;
  int x_ = 0;
  int y_ = 0;
  int start_x_ = 0;
  int start_y_ = 0;
  char command_ = '\0';
};

enum class Anchor : std::uint8_t { start, middle, end };

/// Collects the elements of a figure.
class Svg {
 public:
  void path(Look look, const Path& path);
  void rectangle(Look look, const Box& box);
  void circle(Look look, double x, double y, double radius);
  void line(Look look, double x1, double y1, double x2, double y2);
  void text(Look look, double x, double y, Anchor anchor, std::string_view text);

  /// The whole figure. `facts` are sentences behind the caption's description.
  [[nodiscard]] std::string finish(std::string_view css_class, double width, double height,
                                   const Caption& caption, std::string_view facts) const;

 private:
  /// Neighbours of the same look share a group.
  void use(Look look);

  std::string body_;
  int look_ = -1;
};

/// Lines at an angle that fill the box.
Path hatching(const Box& box, double apart);

}  // namespace spindle::chart
