#include "svg.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

#include "spindle/chart/escape.hpp"
#include "text.hpp"

namespace spindle::chart {
namespace {

struct Appearance {
  Look look;
  std::string_view name;
  std::string_view attributes;
};

#define SPINDLE_HALO \
  " paint-order=\"stroke\" stroke=\"#fff\" stroke-width=\"3\" stroke-linejoin=\"round\""

// In the order of Look.
constexpr std::array appearances = {
    Appearance{Look::title, "title", R"(font-size="14" font-weight="600" fill="#1f2933")"},
    Appearance{Look::word, "word", R"(fill="#1f2933")"},
    Appearance{Look::plot_word, "word", "fill=\"#1f2933\"" SPINDLE_HALO},
    Appearance{Look::quiet, "quiet", R"(fill="#52606d")"},
    Appearance{Look::grid, "grid", R"(fill="none" stroke="#e4e7eb")"},
    Appearance{Look::axis, "axis", R"(fill="none" stroke="#9aa5b1")"},
    Appearance{Look::band, "band",
               R"(fill="#b9cfe2" stroke="#b9cfe2" stroke-width="0.8" stroke-linejoin="round")"},
    Appearance{Look::course, "course",
               R"(fill="none" stroke="#2f6690" stroke-width="1" stroke-linejoin="round")"},
    Appearance{Look::dots, "dots",
               R"(fill="none" stroke="#2f6690" stroke-width="4.4" stroke-linecap="round")"},
    Appearance{Look::small_dots, "dots",
               R"(fill="none" stroke="#2f6690" stroke-width="2.2" stroke-linecap="round")"},
    Appearance{Look::ng, "ng", R"(fill="none" stroke="#b3261e" stroke-width="1.4")"},
    Appearance{Look::ng_shape, "ng-shape", R"(fill="#b3261e")"},
    Appearance{Look::ng_word, "ng-word", "fill=\"#9b1c15\"" SPINDLE_HALO},
    Appearance{Look::specification, "limit",
               R"(fill="none" stroke="#a35200" stroke-width="1.3" stroke-dasharray="7 3")"},
    Appearance{Look::specification_word, "limit-word", "fill=\"#8a4500\"" SPINDLE_HALO},
    Appearance{Look::control, "control",
               R"(fill="none" stroke="#6b4c8a" stroke-width="1.2" stroke-dasharray="4 3")"},
    Appearance{Look::control_word, "control-word", "fill=\"#5b3f78\"" SPINDLE_HALO},
    Appearance{Look::target, "target",
               R"(fill="none" stroke="#3b6e47" stroke-width="1.2" stroke-dasharray="9 3 2 3")"},
    Appearance{Look::target_word, "target-word", "fill=\"#2f5a39\"" SPINDLE_HALO},
    Appearance{Look::mean, "mean", R"(fill="none" stroke="#1d4868" stroke-width="1.2")"},
    Appearance{Look::mean_word, "mean-word", "fill=\"#1d4868\"" SPINDLE_HALO},
    Appearance{Look::change, "change",
               R"(fill="none" stroke="#52606d" stroke-width="1.2" stroke-dasharray="1 2")"},
    Appearance{Look::change_word, "change-word", "fill=\"#3e4c59\"" SPINDLE_HALO},
    Appearance{Look::gap, "gap", R"(fill="#f0f1f3" fill-opacity="0.8" stroke="#9aa5b1")"},
    Appearance{Look::hatch, "hatch", R"(fill="none" stroke="#9aa5b1" stroke-width="0.8")"},
    Appearance{Look::baseline, "baseline", R"(fill="#eef4ee")"},
    Appearance{Look::bar, "bar", R"(fill="#a9c3da" stroke="#2f6690" stroke-width="0.8")"},
    Appearance{Look::ng_bar, "ng-bar", R"(fill="#fbeae8" stroke="#b3261e" stroke-width="0.8")"},
    Appearance{Look::normal, "normal",
               R"(fill="none" stroke="#1f2933" stroke-width="1.2" stroke-dasharray="5 3")"},
    Appearance{Look::curve, "curve",
               R"(fill="none" stroke="#2f6690" stroke-opacity="0.35" stroke-linejoin="round")"},
    Appearance{
        Look::ng_curve, "ng-curve",
        R"(fill="none" stroke="#b3261e" stroke-width="1.5" stroke-dasharray="6 2.5" stroke-linejoin="round")"},
    Appearance{Look::signal, "signal", R"(fill="#b3261e" stroke="#fff" stroke-width="0.8")"},
    Appearance{Look::signal_tag, "signal-tag",
               R"(fill="#fff" stroke="#b3261e" stroke-width="1.2")"},
    Appearance{Look::signal_word, "signal-word", R"(fill="#9b1c15" font-size="10")"},
    Appearance{Look::doubtful, "doubtful", R"(fill="#7b8794" stroke="#fff" stroke-width="0.8")"},
    Appearance{Look::doubtful_tag, "doubtful-tag",
               R"(fill="#fff" stroke="#7b8794" stroke-width="1.2")"},
    Appearance{Look::doubtful_word, "doubtful-word", R"(fill="#52606d" font-size="10")"},
};
#undef SPINDLE_HALO

constexpr bool is_in_order() {
  for (std::size_t at = 0; at < appearances.size(); ++at) {
    if (static_cast<std::size_t>(appearances.at(at).look) != at) return false;
  }
  return true;
}
static_assert(is_in_order());

// Far outside of every figure, and far from what an int of tenths holds.
constexpr double farthest = 1e5;

int tenths(double pixels) {
  if (!std::isfinite(pixels)) return 0;
  return static_cast<int>(std::lround(std::clamp(pixels, -farthest, farthest) * 10));
}

std::string tenths_text(int number) {
  const int size = std::abs(number);
  const std::string_view sign = number < 0 ? "-" : "";
  if (size % 10 == 0) return fmt::format("{}{}", sign, size / 10);
  if (size < 10) return fmt::format("{}.{}", sign, size);
  return fmt::format("{}{}.{}", sign, size / 10, size % 10);
}

std::string px(double pixels) { return tenths_text(tenths(pixels)); }

constexpr std::string_view fonts =
    "system-ui, -apple-system, &#39;Segoe UI&#39;, Roboto, &#39;Liberation Sans&#39;, Arial, "
    "sans-serif";

// Enough for a sentence; a barcode of a megabyte is not read out.
constexpr double longest_spoken = 2000 * letter_height;

}  // namespace

void Path::put(char command, std::initializer_list<int> numbers) {
  bool needs_blank = command == command_;
  if (!needs_blank) text_ += command;
  for (const int number : numbers) {
    if (needs_blank && number >= 0) text_ += ' ';
    text_ += tenths_text(number);
    needs_blank = true;
  }
  // What follows a move without a letter would be a line.
  command_ = command == 'm' || command == 'M' ? '\0' : command;
}

void Path::move(double x, double y) {
  const int to_x = tenths(x);
  const int to_y = tenths(y);
  if (text_.empty()) {
    put('M', {to_x, to_y});
  } else {
    put('m', {to_x - x_, to_y - y_});
  }
  x_ = start_x_ = to_x;
  y_ = start_y_ = to_y;
}

void Path::line(double x, double y) {
  const int dx = tenths(x) - x_;
  const int dy = tenths(y) - y_;
  if (dx == 0 && dy == 0) return;
  if (dy == 0) {
    put('h', {dx});
  } else if (dx == 0) {
    put('v', {dy});
  } else {
    put('l', {dx, dy});
  }
  x_ += dx;
  y_ += dy;
}

void Path::close() {
  text_ += 'z';
  command_ = '\0';
  x_ = start_x_;
  y_ = start_y_;
}

void Path::dot(double x, double y) {
  move(x, y);
  put('h', {0});
}

void Svg::use(Look look) {
  if (look_ == static_cast<int>(look)) return;
  if (look_ >= 0) body_ += "</g>\n";
  look_ = static_cast<int>(look);
  const Appearance& appearance = appearances.at(static_cast<std::size_t>(look));
  body_ += fmt::format("<g class=\"chart-{}\" {}>", appearance.name, appearance.attributes);
}

void Svg::path(Look look, const Path& path) {
  if (path.empty()) return;
  use(look);
  body_ += fmt::format("<path d=\"{}\"/>", path.text());
}

void Svg::rectangle(Look look, const Box& box) {
  use(look);
  body_ += fmt::format(R"(<rect x="{}" y="{}" width="{}" height="{}"/>)", px(box.left), px(box.top),
                       px(std::max(0.0, box.width())), px(std::max(0.0, box.height())));
}

void Svg::circle(Look look, double x, double y, double radius) {
  use(look);
  body_ += fmt::format(R"(<circle cx="{}" cy="{}" r="{}"/>)", px(x), px(y), px(radius));
}

void Svg::line(Look look, double x1, double y1, double x2, double y2) {
  Path path;
  path.move(x1, y1);
  path.line(x2, y2);
  this->path(look, path);
}

void Svg::text(Look look, double x, double y, Anchor anchor, std::string_view text) {
  if (text.empty()) return;
  use(look);
  constexpr std::array anchors = {"", " text-anchor=\"middle\"", " text-anchor=\"end\""};
  body_ += fmt::format("<text x=\"{}\" y=\"{}\"{}>{}</text>", px(x), px(y),
                       anchors.at(static_cast<std::size_t>(anchor)), escape(text));
}

std::string Svg::finish(std::string_view css_class, double width, double height,
                        const Caption& caption, std::string_view facts) const {
  const std::string title = escape(shortened(caption.title, longest_spoken));
  const std::string description = escape(shortened(caption.description, longest_spoken));
  return fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"chart {}\" role=\"img\" "
      "aria-label=\"{}\" viewBox=\"0 0 {} {}\" font-family=\"{}\" font-size=\"12\">\n"
      "<title>{}</title>\n<desc>{}{}{}</desc>\n"
      "<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n{}{}</svg>\n",
      css_class, title, px(width), px(height), fonts, title, description,
      description.empty() || facts.empty() ? "" : " ", escape(facts), body_,
      look_ >= 0 ? "</g>\n" : "");
}

Path hatching(const Box& box, double apart) {
  Path path;
  // Each line is where x + y is the same; anchored to the figure, so that neighbours match.
  const double first = std::ceil((box.left + box.top) / apart) * apart;
  for (double sum = first; sum < box.right + box.bottom; sum += apart) {
    const double left = std::max(box.left, sum - box.bottom);
    const double right = std::min(box.right, sum - box.top);
    if (right <= left) continue;
    path.move(left, sum - left);
    path.line(right, sum - right);
  }
  return path;
}

}  // namespace spindle::chart
