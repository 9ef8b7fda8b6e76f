#include "plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "text.hpp"

namespace spindle::chart {
namespace {

constexpr double largest = 1e100;
constexpr double edge = 8;  ///< between what is drawn and the edge of the figure
constexpr double least_between_labels = 12;

double widest(std::span<const Tick> ticks) {
  double width = 0;
  for (const Tick& tick : ticks) width = std::max(width, text_width(tick.label));
  return width;
}

/// The most ticks whose labels stand apart.
template <typename Make>
std::vector<Tick> fitting(const Scale& scale, double width, const Make& make) {
  for (int most = std::max(1, static_cast<int>(width / 45)); most > 1; --most) {
    std::vector<Tick> ticks = make(most);
    if (ticks.size() < 2) return ticks;
    const double apart = scale(ticks[1].at) - scale(ticks[0].at);
    if (apart >= widest(ticks) + least_between_labels) return ticks;
  }
  return make(1);
}

/// The middle of a label that stays within the figure.
double kept_inside(double x, double width, const Sheet& sheet) {
  return std::clamp(x, width / 2 + 2, std::max(width / 2 + 2, sheet.width - width / 2 - 2));
}

}  // namespace

Sheet sheet_of(Format format) {
  if (format == Format::narrow) {
    return {.is_narrow = true,
            .width = 360,
            .plot_height = 190,
            .widest_margin = 100,
            .most_marks = 500};
  }
  return {.is_narrow = false,
          .width = 900,
          .plot_height = 230,
          .widest_margin = 170,
          .most_marks = 1000};
}

double Scale::operator()(double value) const {
  return begin + (value - low) / (high - low) * (end - begin);
}

double bounded(double value) { return std::clamp(value, -largest, largest); }

void Extent::add(double value) {
  if (!std::isfinite(value)) return;
  const double kept = bounded(value);
  if (empty()) {
    low_ = high_ = kept;
  } else {
    low_ = std::min(low_, kept);
    high_ = std::max(high_, kept);
  }
}

Extent Extent::padded(double share) const {
  Extent padded;
  if (empty()) {
    padded.add(0);
    padded.add(1);
    return padded;
  }
  const double size = std::max(std::abs(low_), std::abs(high_));
  double room = (high_ - low_) * share;
  // All equal, or as good as that for a double.
  if (high_ - low_ <= size * 1e-9 || high_ - low_ < 1e-90) {
    room = size < 1e-90 ? 1 : size * 0.05;
  }
  padded.low_ = low_ - room;
  padded.high_ = high_ + room;
  return padded;
}

Axis value_axis(const Extent& extent, const Quantity& quantity, const Box& box) {
  const Scale scale{
      .low = extent.low(), .high = extent.high(), .begin = box.bottom, .end = box.top};
  const int most = std::max(2, static_cast<int>(box.height() / 38));
  return {.scale = scale,
          .ticks = number_ticks(extent.low(), extent.high(), most),
          .name = with_unit(quantity.name, quantity.unit)};
}

Axis bottom_axis(const Extent& extent, const Quantity& quantity, const Box& box) {
  const Scale scale{
      .low = extent.low(), .high = extent.high(), .begin = box.left, .end = box.right};
  return {
      .scale = scale,
      .ticks = fitting(scale, box.width(),
                       [&](int most) { return number_ticks(extent.low(), extent.high(), most); }),
      .name = with_unit(quantity.name, quantity.unit)};
}

Axis course_axis(std::int64_t low, std::int64_t high, const Course& course, const Box& box) {
  // Room for the marks at both ends.
  constexpr double inset = 6;
  const bool is_time = course.along == Along::time;
  const std::int64_t half = low == high ? (is_time ? 30'000 : 1) : 0;
  const Scale scale{.low = static_cast<double>(low - half),
                    .high = static_cast<double>(high + half),
                    .begin = box.left + inset,
                    .end = box.right - inset};
  const auto make = [&](int most) {
    if (is_time) return time_ticks(low - half, high + half, most, course.utc_offset_minutes);
    return number_ticks(scale.low, scale.high, most, 1);
  };
  const std::string name =
      is_time ? fmt::format("Time ({})", zone_text(course.utc_offset_minutes)) : course.name;
  return {.scale = scale, .ticks = fitting(scale, box.width(), make), .name = name};
}

double label_room(std::span<const Tick> ticks) { return edge + widest(ticks) + 8; }

void draw_value_axis(Svg& svg, const Box& box, const Axis& axis, double name_y) {
  Path grid;
  for (const Tick& tick : axis.ticks) {
    grid.move(box.left, axis.scale(tick.at));
    grid.line(box.right, axis.scale(tick.at));
  }
  svg.path(Look::grid, grid);
  svg.line(Look::axis, box.left, box.top, box.left, box.bottom);
  for (const Tick& tick : axis.ticks) {
    svg.text(Look::quiet, box.left - 6, axis.scale(tick.at) + 4, Anchor::end, tick.label);
  }
  svg.text(Look::quiet, edge, name_y, Anchor::start, shortened(axis.name, 340));
}

double draw_bottom_axis(Svg& svg, const Box& box, const Axis& axis, const Sheet& sheet) {
  Path marks;
  marks.move(box.left, box.bottom);
  marks.line(box.right, box.bottom);
  for (const Tick& tick : axis.ticks) {
    marks.move(axis.scale(tick.at), box.bottom);
    marks.line(axis.scale(tick.at), box.bottom + 4);
  }
  svg.path(Look::axis, marks);
  double y = box.bottom + 4 + letter_height;
  double free_from = 0;
  for (const Tick& tick : axis.ticks) {
    const double width = text_width(tick.label);
    const double x = kept_inside(axis.scale(tick.at), width, sheet);
    if (x - width / 2 < free_from) continue;
    svg.text(Look::quiet, x, y, Anchor::middle, tick.label);
    free_from = x + width / 2 + 4;
  }
  // Days from the right, so that of two that would overlap the one that begins is said.
  bool has_context = false;
  double free_until = box.right - text_width(axis.name) - 8;
  for (auto tick = axis.ticks.rbegin(); tick != axis.ticks.rend(); ++tick) {
    if (tick->context.empty()) continue;
    const double width = text_width(tick->context);
    const double x = kept_inside(axis.scale(tick->at), width, sheet);
    if (x + width / 2 > free_until && tick->at != axis.ticks.front().at) continue;
    svg.text(Look::quiet, x, y + line_height, Anchor::middle, tick->context);
    free_until = x - width / 2 - 4;
    has_context = true;
  }
  y += line_height;
  const double beside = has_context ? box.width() - 90 : box.width();
  svg.text(Look::quiet, box.right, y, Anchor::end, shortened(axis.name, beside));
  return y + 4;
}

Look line_look(LevelKind kind) {
  switch (kind) {
    case LevelKind::specification_limit:
      return Look::specification;
    case LevelKind::control_limit:
      return Look::control;
    case LevelKind::target:
      return Look::target;
    case LevelKind::mean:
      break;
  }
  return Look::mean;
}

Look word_look(LevelKind kind) {
  switch (kind) {
    case LevelKind::specification_limit:
      return Look::specification_word;
    case LevelKind::control_limit:
      return Look::control_word;
    case LevelKind::target:
      return Look::target_word;
    case LevelKind::mean:
      break;
  }
  return Look::mean_word;
}

std::string level_text(const Level& level, const Quantity& quantity) {
  const bool is_computed = level.kind == LevelKind::mean || level.kind == LevelKind::control_limit;
  const std::string value = number_text(level.value, quantity.decimals + (is_computed ? 1 : 0));
  return level.name.empty() ? value : fmt::format("{} {}", level.name, value);
}

double margin_room(std::span<const MarginWord> words, const Sheet& sheet) {
  double width = 6;
  for (const MarginWord& word : words) {
    width = std::max(
        {width, text_width(word.text) + 16, sheet.is_narrow ? 0 : text_width(word.detail) + 16});
  }
  return std::min(width, sheet.widest_margin);
}

void draw_margin(Svg& svg, const Box& box, std::vector<MarginWord> words, const Sheet& sheet) {
  std::stable_sort(words.begin(), words.end(),
                   [](const MarginWord& a, const MarginWord& b) { return a.y < b.y; });
  const auto height = [&](const MarginWord& word) {
    return word.detail.empty() || sheet.is_narrow ? line_height : 2 * line_height - 1;
  };
  // The upper edge of each: pushed down, and back up where that would leave the plot.
  std::vector<double> tops;
  double free_from = box.top - line_height;
  for (const MarginWord& word : words) {
    tops.push_back(std::max(free_from, word.y - line_height / 2));
    free_from = tops.back() + height(word);
  }
  double free_until = box.bottom + line_height;
  for (std::size_t at = words.size(); at-- > 0;) {
    tops[at] = std::min(tops[at], free_until - height(words[at]));
    free_until = tops[at];
  }
  const double room = margin_room(words, sheet) - 14;
  for (std::size_t at = 0; at < words.size(); ++at) {
    const MarginWord& word = words[at];
    const double y = tops[at] + line_height / 2;
    svg.line(Look::axis, box.right + 1, word.y, box.right + 8, y);
    svg.text(word.look, box.right + 11, y + 4, Anchor::start, shortened(word.text, room));
    if (word.detail.empty() || sheet.is_narrow) continue;
    svg.text(Look::quiet, box.right + 11, y + 3 + line_height, Anchor::start,
             shortened(word.detail, room));
  }
}

void TopWords::add(double x, Look look, std::string text) {
  words_.push_back({.x = x, .look = look, .text = std::move(text)});
}

void TopWords::add_optional(double x, Look look, std::string text) {
  words_.push_back({.x = x, .look = look, .text = std::move(text), .is_optional = true});
}

void TopWords::place(double left, const Sheet& sheet) {
  distribute(left, sheet);
  if (dropped_ == 0) return;
  std::erase_if(words_, [](const Word& word) { return word.is_optional; });
  distribute(left, sheet);
}

void TopWords::distribute(double left, const Sheet& sheet) {
  rows_ = 0;
  dropped_ = 0;
  const std::size_t most_rows = sheet.is_narrow ? 3 : 2;
  const double right = sheet.width - 4;
  constexpr double between = 8;
  // From the right, so that the line of a higher word crosses none of those below it.
  std::stable_sort(words_.begin(), words_.end(),
                   [](const Word& a, const Word& b) { return a.x > b.x; });
  std::vector<double> free_until(most_rows, right);
  for (Word& word : words_) {
    word.text = shortened(word.text, 0.6 * (right - left));
    const double width = text_width(word.text) + 4;
    word.ends_at_x = word.x + width > right;
    const double begin = word.ends_at_x ? word.x - width : word.x;
    const auto row = std::find_if(free_until.begin(), free_until.end(), [&](double until) {
      return begin + width + (until < right ? between : 0) <= until;
    });
    word.is_dropped = row == free_until.end();
    if (word.is_dropped) {
      ++dropped_;
      continue;
    }
    word.row = static_cast<std::size_t>(row - free_until.begin());
    rows_ = std::max(rows_, word.row + 1);
    *row = begin;
  }
}

double TopWords::height() const { return static_cast<double>(rows_) * line_height; }

void TopWords::draw(Svg& svg, double bottom) const {
  for (const Word& word : words_) {
    if (word.is_dropped) continue;
    const double y = bottom - static_cast<double>(word.row) * line_height - 5;
    svg.line(Look::change, word.x, y - 10, word.x, bottom);
  }
  for (const Word& word : words_) {
    if (word.is_dropped) continue;
    const double y = bottom - static_cast<double>(word.row) * line_height - 5;
    svg.text(word.look, word.x + (word.ends_at_x ? -4 : 4), y,
             word.ends_at_x ? Anchor::end : Anchor::start, word.text);
  }
}

namespace {

constexpr double symbol_width = 20;

void draw_line_symbol(Svg& svg, Look look, double x, double y) {
  svg.line(look, x, y, x + symbol_width, y);
}

void draw_box_symbol(Svg& svg, Look look, double x, double y) {
  svg.rectangle(look, {.left = x, .top = y - 5, .right = x + symbol_width, .bottom = y + 5});
}

void draw_mark_symbol(Svg& svg, Symbol symbol, double x, double y) {
  const double middle = x + symbol_width / 2;
  Path path;
  switch (symbol) {
    case Symbol::cross:
      draw_cross(path, middle, y);
      return svg.path(Look::ng, path);
    case Symbol::arrow:
      draw_arrow(path, middle - 5, y - 4, true);
      draw_arrow(path, middle + 5, y + 4, false);
      return svg.path(Look::ng_shape, path);
    case Symbol::diamond:
      draw_diamond(path, middle, y);
      return svg.path(Look::signal, path);
    case Symbol::doubtful_diamond:
      draw_diamond(path, middle, y);
      return svg.path(Look::doubtful, path);
    case Symbol::dots:
      draw_line_symbol(svg, Look::course, x, y);
      path.dot(middle, y);
      return svg.path(Look::dots, path);
    case Symbol::band:
      draw_box_symbol(svg, Look::band, x, y);
      return draw_line_symbol(svg, Look::course, x, y);
    case Symbol::hatch:
      draw_box_symbol(svg, Look::gap, x, y);
      return svg.path(
          Look::hatch,
          hatching({.left = x, .top = y - 5, .right = x + symbol_width, .bottom = y + 5}, 6));
    default:
      return;
  }
}

void draw_symbol(Svg& svg, Symbol symbol, double x, double y) {
  switch (symbol) {
    case Symbol::change:
      return svg.line(Look::change, x + symbol_width / 2, y - 6, x + symbol_width / 2, y + 6);
    case Symbol::baseline:
      return draw_box_symbol(svg, Look::baseline, x, y);
    case Symbol::bar:
      return draw_box_symbol(svg, Look::bar, x, y);
    case Symbol::cause:
      return draw_box_symbol(svg, Look::ng_bar, x, y);
    case Symbol::ng_bar:
      draw_box_symbol(svg, Look::ng_bar, x, y);
      return svg.path(
          Look::ng,
          hatching({.left = x, .top = y - 5, .right = x + symbol_width, .bottom = y + 5}, 5));
    case Symbol::normal:
      return draw_line_symbol(svg, Look::normal, x, y);
    case Symbol::curve:
      return draw_line_symbol(svg, Look::course, x, y);
    case Symbol::ng_curve:
      return draw_line_symbol(svg, Look::ng_curve, x, y);
    case Symbol::specification:
      return draw_line_symbol(svg, Look::specification, x, y);
    case Symbol::control:
      return draw_line_symbol(svg, Look::control, x, y);
    case Symbol::target:
      return draw_line_symbol(svg, Look::target, x, y);
    case Symbol::mean:
      return draw_line_symbol(svg, Look::mean, x, y);
    default:
      return draw_mark_symbol(svg, symbol, x, y);
  }
}

Symbol symbol_of(LevelKind kind) {
  switch (kind) {
    case LevelKind::specification_limit:
      return Symbol::specification;
    case LevelKind::control_limit:
      return Symbol::control;
    case LevelKind::target:
      return Symbol::target;
    case LevelKind::mean:
      break;
  }
  return Symbol::mean;
}

}  // namespace

void Legend::add(Symbol symbol, std::string text) {
  entries_.push_back({.symbol = symbol, .text = std::move(text)});
}

void Legend::add_origins(std::span<const Level> levels) {
  // Those of one kind and origin in one entry.
  std::vector<bool> is_said(levels.size(), false);
  for (std::size_t at = 0; at < levels.size(); ++at) {
    if (is_said[at] || levels[at].origin.empty() || !std::isfinite(levels[at].value)) continue;
    std::vector<std::string_view> names;
    for (std::size_t other = at; other < levels.size(); ++other) {
      const Level& level = levels[other];
      if (level.kind != levels[at].kind || level.origin != levels[at].origin) continue;
      is_said[other] = true;
      if (std::find(names.begin(), names.end(), level.name) == names.end()) {
        names.push_back(level.name);
      }
    }
    add(symbol_of(levels[at].kind),
        fmt::format("{}: {}", fmt::join(names, ", "), levels[at].origin));
  }
}

double Legend::draw(Svg& svg, double left, double right, double top) const {
  if (entries_.empty()) return top;
  double x = left;
  double y = top + line_height / 2 + 2;
  for (const Entry& entry : entries_) {
    const double before = entry.symbol == Symbol::none ? 0 : symbol_width + 6;
    const std::string text = shortened(entry.text, right - left - before);
    const double width = before + text_width(text);
    if (x > left && x + width > right) {
      x = left;
      y += line_height + 3;
    }
    draw_symbol(svg, entry.symbol, x, y);
    svg.text(Look::quiet, x + before, y + 4, Anchor::start, text);
    x += width + 14;
  }
  return y + line_height / 2 + 2;
}

std::string Legend::facts() const {
  std::string facts;
  for (const Entry& entry : entries_) {
    facts += fmt::format("{}{}.", facts.empty() ? "" : " ", shortened(entry.text, 4000));
  }
  return facts;
}

void draw_cross(Path& path, double x, double y) {
  path.move(x - 3, y - 3);
  path.line(x + 3, y + 3);
  path.move(x + 3, y - 3);
  path.line(x - 3, y + 3);
}

void draw_arrow(Path& path, double x, double y, bool points_up) {
  const double base = points_up ? y + 6.5 : y - 6.5;
  path.move(x, y);
  path.line(x + 3.5, base);
  path.line(x - 3.5, base);
  path.close();
}

void draw_diamond(Path& path, double x, double y) {
  path.move(x, y - 5);
  path.line(x + 5, y);
  path.line(x, y + 5);
  path.line(x - 5, y);
  path.close();
}

double draw_title(Svg& svg, const Caption& caption, const Sheet& sheet) {
  constexpr double size = 14;
  svg.text(Look::title, edge, 19, Anchor::start,
           shortened(caption.title, sheet.width - 2 * edge, size));
  return caption.title.empty() ? 8 : 30;
}

std::string finish(const Svg& svg, const Sheet& sheet, double height, const Caption& caption,
                   std::string_view facts) {
  return svg.finish(sheet.is_narrow ? "chart-narrow" : "chart-wide", sheet.width, std::ceil(height),
                    caption, facts);
}

std::string empty_figure(const Caption& caption, Format format, const std::string& why) {
  const Sheet sheet = sheet_of(format);
  Svg svg;
  const double top = draw_title(svg, caption, sheet);
  const Box box{.left = edge, .top = top, .right = sheet.width - edge, .bottom = top + 60};
  svg.rectangle(Look::grid, box);
  svg.text(Look::quiet, sheet.width / 2, top + 34, Anchor::middle,
           shortened(why, box.width() - 2 * edge));
  return finish(svg, sheet, box.bottom + edge, caption, why + ".");
}

}  // namespace spindle::chart
