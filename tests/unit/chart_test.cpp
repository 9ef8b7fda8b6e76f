// Figures: what they say, that they hold whatever comes from outside, and that they stay small.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <random>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "chart/course.hpp"
#include "chart/text.hpp"
#include "spindle/base/utf8.hpp"
#include "spindle/chart/control_chart.hpp"
#include "spindle/chart/curves.hpp"
#include "spindle/chart/escape.hpp"
#include "spindle/chart/histogram.hpp"
#include "spindle/chart/pareto.hpp"
#include "spindle/chart/run_chart.hpp"
#include "spindle/chart/ticks.hpp"

using namespace spindle::chart;

namespace {

constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();
constexpr double infinite = std::numeric_limits<double>::infinity();
constexpr std::int64_t start = 1'773'298'800'000;  // 2026-03-12 07:00 UTC
constexpr std::int64_t hour = 3'600'000;

std::size_t count_of(std::string_view text, std::string_view part) {
  std::size_t count = 0;
  for (auto at = text.find(part); at != std::string_view::npos; at = text.find(part, at + 1)) {
    ++count;
  }
  return count;
}

bool contains(std::string_view text, std::string_view part) {
  return text.find(part) != std::string_view::npos;
}

// ---- a strict reader of the XML that figures are made of ----

/// Only the entities that every reader of XML and HTML knows.
bool has_known_entities(std::string_view text) {
  for (auto at = text.find('&'); at != std::string_view::npos; at = text.find('&', at + 1)) {
    const std::string_view rest = text.substr(at);
    bool is_known = false;
    for (const std::string_view entity : {"&amp;", "&lt;", "&gt;", "&quot;", "&#39;"}) {
      is_known = is_known || rest.starts_with(entity);
    }
    if (!is_known) return false;
  }
  return true;
}

/// ` name="value"` any number of times.
bool is_attributes(std::string_view text) {
  std::vector<std::string_view> names;
  while (!text.empty()) {
    if (text.front() != ' ') return false;
    const std::size_t equals = text.find("=\"");
    if (equals == std::string_view::npos) return false;
    const std::string_view name = text.substr(1, equals - 1);
    if (name.empty() || name.find_first_of(" \"<>&'") != std::string_view::npos) return false;
    if (std::find(names.begin(), names.end(), name) != names.end()) return false;
    names.push_back(name);
    const std::size_t end = text.find('"', equals + 2);
    if (end == std::string_view::npos) return false;
    const std::string_view value = text.substr(equals + 2, end - equals - 2);
    if (value.find('<') != std::string_view::npos || !has_known_entities(value)) return false;
    text.remove_prefix(end + 1);
  }
  return true;
}

bool is_text(std::string_view text) {
  if (text.find('>') != std::string_view::npos || !has_known_entities(text)) return false;
  while (!text.empty()) {
    const spindle::CodePoint first = spindle::first_code_point(text);
    const bool is_line_end = first.value == U'\n';
    if (!first.well_formed || (first.value < 0x20 && !is_line_end)) return false;
    if (first.value == 0xFFFE || first.value == 0xFFFF) return false;
    text.remove_prefix(first.length);
  }
  return true;
}

/// What is wrong with a text that should be one element; empty when nothing is.
std::string fault_of(std::string_view text) {
  std::vector<std::string> open;
  while (true) {
    const std::size_t begin = text.find('<');
    const std::string_view before = text.substr(0, begin);
    if (!is_text(before)) return fmt::format("no text: {}", before.substr(0, 80));
    if (begin == std::string_view::npos) return open.empty() ? "" : "not closed: " + open.back();
    const std::size_t end = text.find('>', begin);
    if (end == std::string_view::npos) return "a tag does not end";
    std::string_view tag = text.substr(begin + 1, end - begin - 1);
    text.remove_prefix(end + 1);
    if (tag.starts_with('/')) {
      if (open.empty() || open.back() != tag.substr(1)) return fmt::format("closes {}", tag);
      open.pop_back();
      continue;
    }
    const bool is_empty_element = tag.ends_with('/');
    if (is_empty_element) tag.remove_suffix(1);
    const std::size_t name_end = std::min(tag.find(' '), tag.size());
    if (!is_attributes(tag.substr(name_end))) return fmt::format("attributes of: {}", tag);
    if (!is_empty_element) open.emplace_back(tag.substr(0, name_end));
  }
}

/// The values of all attributes with this name.
std::vector<std::string> attributes(std::string_view text, std::string_view name) {
  const std::string begin = fmt::format(" {}=\"", name);
  std::vector<std::string> values;
  for (auto at = text.find(begin); at != std::string_view::npos; at = text.find(begin, at + 1)) {
    const std::size_t from = at + begin.size();
    values.emplace_back(text.substr(from, text.find('"', from) - from));
  }
  return values;
}

/// What stands in the groups with this class.
std::string part_of(std::string_view figure, std::string_view look) {
  const std::string begin = fmt::format("<g class=\"chart-{}\"", look);
  std::string part;
  for (auto at = figure.find(begin); at != std::string_view::npos;
       at = figure.find(begin, at + 1)) {
    part += figure.substr(at, figure.find("</g>", at) - at);
  }
  return part;
}

using Corner = std::pair<double, double>;

/// Reads the data of a path into its lines, each with its corners.
class PathReader {
 public:
  explicit PathReader(std::string_view data) : data_(data) {}

  std::vector<std::vector<Corner>> run() {
    while (!data_.empty()) {
      const char first = data_.front();
      if (std::isalpha(static_cast<unsigned char>(first)) != 0) {
        command_ = first;
        data_.remove_prefix(1);
      }
      step();
    }
    return std::move(lines_);
  }

 private:
  double number() {
    while (data_.starts_with(' ')) data_.remove_prefix(1);
    std::size_t end = data_.starts_with('-') ? 1 : 0;
    while (end < data_.size() &&
           (std::isdigit(static_cast<unsigned char>(data_[end])) != 0 || data_[end] == '.')) {
      ++end;
    }
    REQUIRE(end > 0);
    const double value = std::stod(std::string(data_.substr(0, end)));
    data_.remove_prefix(end);
    return value;
  }

  void step() {
    switch (command_) {
      case 'M':
      case 'm': {
        const Corner from = command_ == 'm' ? at_ : Corner{0, 0};
        at_.first = from.first + number();
        at_.second = from.second + number();
        lines_.emplace_back();
        break;
      }
      case 'l':
        at_.first += number();
        at_.second += number();
        break;
      case 'h':
        at_.first += number();
        break;
      case 'v':
        at_.second += number();
        break;
      case 'z':
        at_ = lines_.back().front();
        return;
      default:
        FAIL("a command of a path that is not written: " << command_);
    }
    lines_.back().push_back(at_);
  }

  std::string_view data_;
  char command_ = '\0';
  Corner at_ = {0, 0};
  std::vector<std::vector<Corner>> lines_ = {};
};

std::vector<std::vector<Corner>> lines_of(std::string_view part) {
  std::vector<std::vector<Corner>> lines;
  for (const std::string& data : attributes(part, "d")) {
    for (auto& line : PathReader(data).run()) lines.push_back(std::move(line));
  }
  return lines;
}

// ---- what is drawn ----

/// Crosses are two lines each.
std::size_t crosses_in(std::string_view figure) {
  // The legend has one.
  const std::size_t lines = lines_of(part_of(figure, "ng")).size();
  return lines == 0 ? 0 : lines / 2 - 1;
}

std::size_t arrows_in(std::string_view figure) {
  // The legend has one up and one down.
  const std::size_t lines = lines_of(part_of(figure, "ng-shape")).size();
  return lines == 0 ? 0 : lines - 2;
}

const std::vector<Level> limits = {
    {.kind = LevelKind::specification_limit, .value = 2.98, .name = "USL", .origin = "tool's own"},
    {.kind = LevelKind::specification_limit, .value = 2.44, .name = "LSL", .origin = "tool's own"},
    {.kind = LevelKind::target, .value = 2.71, .name = "target"},
    {.kind = LevelKind::mean, .value = 2.7134, .name = "mean"},
};

const Quantity torque = {.name = "Torque", .unit = "N.m"};

/// Good values around 2.71; of each `ng_every` one that was aborted.
std::vector<Sample> samples_of(std::size_t count, std::size_t ng_every = 0) {
  std::mt19937 random(7);
  std::vector<Sample> samples;
  for (std::size_t at = 0; at < count; ++at) {
    const double noise = static_cast<double>(random() % 21) * 0.01 - 0.10;
    Sample sample{.at = static_cast<std::int64_t>(at), .value = 2.71 + noise};
    if (ng_every != 0 && at % ng_every == 1) sample = {sample.at, 1.2 + noise, true};
    samples.push_back(sample);
  }
  return samples;
}

RunChart run_of(std::vector<Sample> samples) {
  return {.caption = {.title = "Torque"},
          .quantity = torque,
          .samples = std::move(samples),
          .levels = limits};
}

ControlChart control_of(std::size_t count) {
  ControlChart chart{.caption = {.title = "I chart"},
                     .values = {.quantity = torque,
                                .points = {},
                                .levels = {{LevelKind::control_limit, 2.81, "UCL"},
                                           {LevelKind::mean, 2.71, "mean"},
                                           {LevelKind::control_limit, 2.61, "LCL"}}},
                     .variation = ControlPanel{.quantity = torque, .points = {}}};
  for (const Sample& sample : samples_of(count)) {
    chart.values.points.push_back({.at = sample.at, .value = sample.value});
    chart.variation->points.push_back({.at = sample.at, .value = 0.03});
  }
  return chart;
}

Histogram histogram_of(std::vector<HistogramClass> classes) {
  return {.caption = {.title = "Distribution"},
          .quantity = torque,
          .first = 260,
          .classes = std::move(classes),
          .levels = limits};
}

Curve curve_of(double peak, bool is_ng) {
  Curve curve{.name = "1024", .points = {}, .is_ng = is_ng};
  for (int at = 0; at <= 500; ++at) {
    const double angle = 2.0 * at;
    curve.points.push_back({.x = angle, .y = angle < 800 ? 0.2 : peak * (angle - 800) / 200});
  }
  return curve;
}

Curves curves_of(std::size_t count) {
  Curves chart{.caption = {.title = "Torque over angle"},
               .x = {.name = "Angle", .unit = "\u00B0", .decimals = 0},
               .y = torque,
               .curves = {}};
  for (std::size_t at = 0; at < count; ++at) {
    chart.curves.push_back(curve_of(2.7 + 0.001 * static_cast<double>(at), at % 10 == 3));
  }
  return chart;
}

const std::string hostile =
    "<script>alert('x')</script> \"&amp;\" ]]> \x01\x1b[31m\xff\xc3(\xe2\x80\xae\xef\xbf\xbf\r\n";

/// Every figure with hostile words at all places that take one, and hostile numbers.
std::vector<std::string> hostile_figures(Format format) {
  const Caption caption{.title = hostile, .description = hostile};
  const Quantity quantity{.name = hostile, .unit = hostile, .decimals = -1000};
  constexpr std::int64_t first = std::numeric_limits<std::int64_t>::min();
  constexpr std::int64_t last = std::numeric_limits<std::int64_t>::max();
  const double largest = std::numeric_limits<double>::max();
  const double least = std::numeric_limits<double>::denorm_min();
  const std::vector<Level> levels = {
      {LevelKind::mean, not_a_number, hostile, hostile},
      {LevelKind::target, infinite, hostile, hostile},
      {LevelKind::specification_limit, largest, hostile, hostile, last, first}};
  const std::vector<Change> changes = {{first, hostile}, {last, hostile}, {0, ""}};
  const std::vector<Gap> gaps = {{last, first, 3}, {first, last, 1}};
  const std::vector<Sample> samples = {
      {first, largest},  {0, not_a_number},       {0, -largest, true}, {last, infinite, true},
      {last, -infinite}, {5, not_a_number, true}, {7, least},          {6, 0, false, true}};
  std::vector<std::string> figures;
  for (const Along along : {Along::index, Along::time}) {
    const Course course{.along = along, .name = hostile, .utc_offset_minutes = 100'000};
    const RunChart run{caption, course, quantity, samples, levels, changes, gaps};
    figures.push_back(run_chart(run, format));
    figures.push_back(small_run_chart(run));
    ControlPanel panel{.quantity = quantity, .points = {}, .levels = levels};
    for (const Sample& sample : samples) panel.points.push_back({sample.at, sample.value, 99});
    figures.push_back(control_chart({.caption = caption,
                                     .course = course,
                                     .values = panel,
                                     .variation = panel,
                                     .baseline = Baseline{last, first, hostile},
                                     .changes = changes,
                                     .gaps = gaps,
                                     .doubt = hostile},
                                    format));
  }
  for (const double step : {0.01, 0.0, -1.0, least, largest, not_a_number, infinite}) {
    figures.push_back(histogram({.caption = caption,
                                 .quantity = quantity,
                                 .step = step,
                                 .first = first,
                                 .steps_per_class = step > 1 ? last : first,
                                 .classes = {{1, 7}, {0, 0}, {1'000'000'000'000, 0}},
                                 .below = 1,
                                 .levels = levels,
                                 .normal = NormalCurve{0, least}},
                                format));
  }
  figures.push_back(pareto({caption, hostile, {{hostile, hostile, 1}, {"", "", 5}}}, format));
  figures.push_back(
      curves({.caption = caption,
              .x = quantity,
              .y = quantity,
              .curves = {{hostile, {{0, 0}, {largest, -largest}, {1, infinite}}, true},
                         {hostile, {{not_a_number, 1}}, true},
                         {hostile, {{5, 5}}}},
              .steps = {{not_a_number, hostile}, {0, hostile}},
              .levels = levels},
             format));
  return figures;
}

std::vector<std::string> ordinary_figures(Format format) {
  RunChart run = run_of(samples_of(300, 20));
  run.course = {.along = Along::time, .utc_offset_minutes = 60};
  for (Sample& sample : run.samples) sample.at = start + sample.at * 60'000;
  run.changes = {{start + hour, "settings changed"}};
  run.gaps = {{start + 2 * hour, start + 3 * hour, 14}};
  ControlChart control = control_of(300);
  control.baseline = Baseline{0, 50};
  control.values.points[100].signal = 1;
  Histogram bars = histogram_of({{3, 1}, {20, 0}, {400, 0}, {0, 0}, {30, 0}});
  bars.normal = NormalCurve{2.62, 0.01};
  return {run_chart(run, format),
          run_chart(run_of(samples_of(5000, 20)), format),
          small_run_chart(run),
          control_chart(control, format),
          histogram(bars, format),
          pareto({{"NG"}, "NG results", {{"E333", "released", 11}, {"E335", "torque", 4}}}, format),
          curves(curves_of(40), format)};
}

std::vector<std::string> empty_figures(Format format) {
  return {run_chart(run_of({}), format),
          small_run_chart(run_of({})),
          run_chart(run_of({{0, not_a_number}}), format),
          control_chart(control_of(0), format),
          histogram(histogram_of({}), format),
          histogram(histogram_of({{0, 0}}), format),
          pareto({{"NG"}, "NG results", {}}, format),
          pareto({{"NG"}, "NG results", {{"E1", "never", 0}}}, format),
          curves(curves_of(0), format),
          curves({.caption = {}, .x = {}, .y = {}, .curves = {Curve{}}}, format)};
}

void check_figure(const std::string& figure) {
  CAPTURE(figure.substr(0, 400));
  CHECK(fault_of(figure) == "");
  CHECK(figure.starts_with("<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"chart chart-"));
  CHECK(figure.ends_with("</svg>\n"));
  CHECK(contains(figure, " role=\"img\" aria-label=\""));
  CHECK(count_of(figure, "<title>") == 1);
  CHECK(count_of(figure, "<desc>") == 1);
  for (const std::string_view active : {"<script", "<a ", "<image", "<use", "<foreignObject",
                                        "url(", "href", "<style", " id=", " on", "@import"}) {
    CHECK_MESSAGE(!contains(figure, active), active);
  }
  CHECK(count_of(figure, "http") == 1);
  // Every number that places something.
  const std::string_view name_of_numbers[] = {"x",     "y",      "cx", "cy",     "r",
                                              "width", "height", "d",  "viewBox"};
  for (const std::string_view name : name_of_numbers) {
    for (const std::string& value : attributes(figure, name)) {
      CHECK_MESSAGE(value.find_first_not_of("0123456789.- Mmlhvz%") == std::string::npos, value);
    }
  }
  for (const std::string& size : attributes(figure, "width")) CHECK(!size.starts_with('-'));
}

}  // namespace

TEST_CASE("chart: a text is escaped for content and attributes") {
  struct Row {
    std::string text;
    std::string escaped;
  };
  const Row rows[] = {
      {"", ""},
      {"station 3", "station 3"},
      {"<script>&'\"", "&lt;script&gt;&amp;&#39;&quot;"},
      {"&lt;", "&amp;lt;"},
      {"Schl\u00FCssel \u65E5\u672C \U0001F527 \u202F",
       "Schl\u00FCssel \u65E5\u672C \U0001F527 \u202F"},
      {std::string("a\0b", 3), "a\uFFFDb"},
      {"\x01\t\n\r\x1b\x7f\xc2\x85", "\uFFFD\uFFFD\uFFFD\uFFFD\uFFFD\uFFFD\uFFFD"},
      {"\xff\xfe", "\uFFFD\uFFFD"},
      {"\xe2\x82", "\uFFFD"},
      {"\xed\xa0\x80", "\uFFFD\uFFFD\uFFFD"},
      {"\u202E\u2066\u200B\uFEFF", "\uFFFD\uFFFD\uFFFD\uFFFD"},
      {"\uFFFE\uFFFF\uFDD0\U0001FFFF", "\uFFFD\uFFFD\uFFFD\uFFFD"},
  };
  for (const Row& row : rows) CHECK(escape(row.text) == row.escaped);
}

TEST_CASE("chart: figures are well-formed and hold nothing active, whatever comes from outside") {
  for (const Format format : {Format::wide, Format::narrow}) {
    for (const auto& figures :
         {ordinary_figures(format), hostile_figures(format), empty_figures(format)}) {
      for (const std::string& figure : figures) check_figure(figure);
    }
    for (const std::string& figure : hostile_figures(format)) {
      CHECK(contains(figure, "&lt;script&gt;"));
      // In words too: a number that is none is left out.
      CHECK(!contains(figure, ">nan"));
      CHECK(!contains(figure, ">inf"));
      CHECK(!contains(figure, " nan"));
      CHECK(!contains(figure, " inf"));
    }
  }
}

TEST_CASE("chart: the reader of these tests finds what is not well-formed") {
  for (const char* text :
       {"<a>", "</a>", "<a></b>", "<a b></a>", "<a b=c/>", "<a>&x;</a>", "<a>></a>",
        "<a b=\"1\" b=\"2\"/>", "<a>\x01</a>", "<a>\xff</a>", "<a b=\"<\"/>"}) {
    CAPTURE(text);
    CHECK(fault_of(text) != "");
  }
  CHECK(fault_of("<a b=\"1 2\"><c/>&lt;</a>\n") == "");
}

TEST_CASE("chart: a figure without values says so") {
  for (const Format format : {Format::wide, Format::narrow}) {
    for (const std::string& figure : empty_figures(format)) {
      CAPTURE(figure);
      CHECK(contains(figure, ">no values"));
      CHECK(contains(figure, "<desc>no values"));
    }
  }
  RunChart missed = run_of({});
  missed.gaps = {{0, 1, 3}, {4, 5, 11}};
  CHECK(contains(run_chart(missed), ">no values; 14 missed in 2 gaps<"));
}

TEST_CASE("chart: the same input gives the same bytes") {
  for (const Format format : {Format::wide, Format::narrow}) {
    CHECK(ordinary_figures(format) == ordinary_figures(format));
  }
}

TEST_CASE("chart: ticks are round and their labels exact") {
  struct Row {
    double low;
    double high;
    int most;
    std::string labels;
  };
  const Row rows[] = {
      {0, 1, 5, "0.0 0.2 0.4 0.6 0.8 1.0"},
      {0.1, 0.35, 3, "0.1 0.2 0.3"},
      {2.4, 3.02, 6, "2.4 2.6 2.8 3.0"},
      {2.44, 2.4401, 4, "2.44000 2.44005 2.44010"},
      {-0.3, 0.3, 6, "-0.3 -0.2 -0.1 0.0 0.1 0.2 0.3"},
      {0, 70, 10, "0 10 20 30 40 50 60 70"},
      {0, 100'000, 2, "0 50\u202F000 100\u202F000"},
      {-12'000, -4000, 4, "-12\u202F000 -10\u202F000 -8000 -6000 -4000"},
      {0, 2e12, 4, "0 5e11 1e12 1.5e12 2e12"},
      {0, 3e-9, 3, "0 1e-9 2e-9 3e-9"},
      {-1e100, 1e100, 2, "-1e100 0 1e100"},
      {7, 7, 3, "7"},
  };
  for (const Row& row : rows) {
    std::string labels;
    for (const Tick& tick : number_ticks(row.low, row.high, row.most)) {
      labels += (labels.empty() ? "" : " ") + tick.label;
      CHECK(tick.at >= row.low - 1e-12 * std::abs(row.low));
      CHECK(tick.at <= row.high + 1e-12 * std::abs(row.high));
    }
    CHECK(labels == row.labels);
  }
  CHECK(number_ticks(0, 3, 10, 1).size() == 4);  // counts are integers
  CHECK(number_ticks(0.1, 0.3, 2)[1].at == 0.2);
  CHECK(number_ticks(-1e308, 1e308, 5).size() <= 6);
  CHECK(number_ticks(0, 5e-324, 5).size() <= 6);
}

TEST_CASE("chart: ticks of times are round in local time") {
  struct Row {
    std::int64_t low;
    std::int64_t length;
    int most;
    int offset;
    std::string labels;
  };
  constexpr std::int64_t day = 24 * hour;
  const Row rows[] = {
      {start, 1000, 4, 0, "07:00:00.000 (2026-03-12) 07:00:00.500 07:00:01.000"},
      {start, 60'000, 4, 0, "07:00:00 (2026-03-12) 07:00:15 07:00:30 07:00:45 07:01:00"},
      {start, 4 * hour, 4, 90, "09:00 (2026-03-12) 10:00 11:00 12:00"},
      {start, 24 * hour, 4, -480, "00:00 (2026-03-12) 06:00 12:00 18:00"},
      {start, 30 * hour, 4, 0, "12:00 (2026-03-12) 00:00 (2026-03-13) 12:00"},
      {start, 4 * day, 5, 0, "13 Mar (2026) 14 Mar 15 Mar 16 Mar"},
      {start, 28 * day, 5, 0, "16 Mar (2026) 23 Mar 30 Mar 6 Apr"},  // Mondays
      {start, 365 * day, 5, 0, "Apr (2026) Jul Oct Jan (2027)"},
      {start, 3650 * day, 6, 0, "2028 2030 2032 2034 2036"},
      {-day, 2 * day, 3, 0, "31 Dec (1969) 1 Jan (1970) 2 Jan"},
  };
  for (const Row& row : rows) {
    std::string labels;
    for (const Tick& tick : time_ticks(row.low, row.low + row.length, row.most, row.offset)) {
      labels += (labels.empty() ? "" : " ") + tick.label;
      if (!tick.context.empty()) labels += fmt::format(" ({})", tick.context);
    }
    CHECK(labels == row.labels);
  }
  for (const int most : {1, 3, 20}) {
    for (std::int64_t length = 1; length < 100'000 * day; length *= 3) {
      const auto ticks = time_ticks(start, start + length, most, 345);
      CHECK(ticks.size() <= static_cast<std::size_t>(most) + 1);
    }
    CHECK(!time_ticks(std::numeric_limits<std::int64_t>::min(),
                      std::numeric_limits<std::int64_t>::max(), most, 0)
               .empty());
  }
}

TEST_CASE("chart: times and numbers in words") {
  CHECK(time_text(start + 245'678, 0) == "2026-03-12 07:04:05 +00:00");
  CHECK(time_text(start, 330) == "2026-03-12 12:30:00 +05:30");
  CHECK(time_text(-1, -90) == "1969-12-31 22:29:59 -01:30");
  CHECK(zone_text(0) == "UTC");
  CHECK(zone_text(60) == "UTC+01:00");
  CHECK(zone_text(-570) == "UTC-09:30");
  CHECK(number_text(2.71, 2) == "2.71");
  CHECK(number_text(10, 2) == "10.00");
  CHECK(number_text(-0.0, 2) == "0.00");
  CHECK(number_text(-0.004999, 2) == "-0.005");
  CHECK(number_text(1.5e12, 2) == "1.5e12");
  CHECK(number_text(-2.5e-7, 2) == "-2.5e-7");
  CHECK(number_text(not_a_number, 2) == "\u2013");
  CHECK(grouped(0) == "0");
  CHECK(grouped(9999) == "9999");
  CHECK(grouped(12'345) == "12\u202F345");
  CHECK(grouped(1'000'000) == "1\u202F000\u202F000");
  CHECK(shortened("settings changed", 1000) == "settings changed");
  CHECK(shortened("settings changed", 60).ends_with("\u2026"));
  CHECK(text_width(shortened("settings changed", 60)) <= 60);
  CHECK(shortened("\u65E5\u672C\u65E5\u672C", 25) == "\u65E5\u2026");
}

TEST_CASE("chart: the band holds the smallest and the largest value of each column") {
  const std::vector<Sample> samples = samples_of(20'000);
  const Scale x{.low = 0, .high = 19'999, .begin = 40, .end = 340};
  const Scale y{.low = 2.5, .high = 2.9, .begin = 240, .end = 10};
  Svg svg;
  CHECK(draw_samples(svg, samples, {}, x, y) == Drawn::band);
  const std::string band = part_of(svg.finish("", 400, 250, {}, ""), "band");
  const auto areas = lines_of(band);
  REQUIRE(areas.size() == 1);
  const auto columns = columns_of(samples, x);
  REQUIRE(columns.size() == 300);
  std::uint64_t counted_samples = 0;
  for (std::size_t at = 0; at < columns.size(); ++at) {
    counted_samples += columns[at].count;
    double top = 1e9;
    double bottom = -1e9;
    for (const auto& [corner_x, corner_y] : areas[0]) {
      if (std::abs(corner_x - (40.5 + static_cast<double>(at))) > 0.05) continue;
      top = std::min(top, corner_y);
      bottom = std::max(bottom, corner_y);
    }
    CHECK(top == doctest::Approx(y(columns[at].high)).epsilon(0.001));
    CHECK(bottom == doctest::Approx(y(columns[at].low)).epsilon(0.001));
  }
  CHECK(counted_samples == samples.size());
  for (const Sample& sample : samples) {
    const auto at = static_cast<std::size_t>(
        std::min(299.0, std::floor(x(static_cast<double>(sample.at)) - 40)));
    CHECK(columns[at].low <= sample.value);
    CHECK(columns[at].high >= sample.value);
  }
}

TEST_CASE("chart: a pause of columns interrupts the band") {
  std::vector<Sample> samples = samples_of(20'000);
  std::erase_if(samples,
                [](const Sample& sample) { return sample.at > 9000 && sample.at < 11'000; });
  const std::string figure = run_chart(run_of(samples));
  // The legend has a box, no path.
  CHECK(lines_of(part_of(figure, "band")).size() == 2);
}

TEST_CASE("chart: a million results make a small file") {
  for (const std::size_t ng_every : {0U, 100U, 2U}) {
    RunChart chart = run_of(samples_of(1'000'000, ng_every));
    CHECK(run_chart(chart, Format::wide).size() < 40'000);
    CHECK(run_chart(chart, Format::narrow).size() < 40'000);
    CHECK(small_run_chart(chart).size() < 12'000);
    ControlChart control{.caption = {}, .values = {.quantity = torque, .points = {}}};
    for (const Sample& sample : chart.samples) {
      control.values.points.push_back({sample.at, sample.value, sample.is_ng ? 1 : 0});
    }
    CHECK(control_chart(control).size() < 110'000);
  }
}

TEST_CASE("chart: every NG result keeps its mark while there are few") {
  std::vector<Sample> samples = samples_of(100'000);
  for (std::size_t at = 0; at < 959; ++at) {
    Sample& sample = samples[at * 104 + 3];
    sample.is_ng = true;
    sample.value = at % 2 == 0 ? 1.3 : 2.40;
  }
  const std::string figure = run_chart(run_of(samples));
  CHECK(crosses_in(figure) == 479);
  CHECK(arrows_in(figure) == 480);
  CHECK(contains(figure, ">99\u202F041 OK: range and mean a column<"));
  CHECK(contains(figure, ">479 NG<"));
  CHECK(contains(figure, ">480 NG outside the scale<"));
}

TEST_CASE("chart: many NG results are thinned, and that is said") {
  const std::string figure = run_chart(run_of(samples_of(100'000, 3)));
  CHECK(arrows_in(figure) <= 1000);
  CHECK(arrows_in(figure) > 200);
  CHECK(contains(figure, ">33\u202F333 NG outside the scale, not each drawn<"));
}

TEST_CASE("chart: of spots too many one remains in each cell") {
  const Box box{.left = 0, .top = 0, .right = 100, .bottom = 10};
  std::vector<Spot> spots;
  for (std::size_t at = 0; at < 4000; ++at) {
    spots.push_back(
        {.x = static_cast<double>(at % 1000) / 10, .y = static_cast<double>(at % 4), .index = at});
  }
  CHECK(thinned(spots, 4000, box).size() == 4000);
  // Each pixel has spots in four rows.
  CHECK(thinned(spots, 3999, box).size() == 400);
  CHECK(thinned(spots, 399, box).size() == 100);
  CHECK(thinned(spots, 0, box).size() <= 1);
}

TEST_CASE("chart: NG results far away leave the scale alone, near ones are on it") {
  const std::vector<Sample> good = samples_of(200);
  std::vector<Sample> with_ng = good;
  with_ng.push_back({200, 0.3, true});
  with_ng.push_back({201, 99.0, true});
  with_ng.push_back({202, not_a_number, true});
  RunChart chart = run_of(good);
  chart.samples.push_back({202, 2.71});
  RunChart other = run_of(with_ng);
  other.samples.push_back({202, 2.71});
  CHECK(part_of(run_chart(chart), "course") == part_of(run_chart(other), "course"));
  const std::string figure = run_chart(other);
  CHECK(arrows_in(figure) == 2);
  CHECK(contains(figure, ">1 without a value<"));
  other.samples.push_back({203, 3.01, true});
  CHECK(crosses_in(run_chart(other)) == 1);
}

TEST_CASE("chart: one value, equal values and huge ones are drawn") {
  const auto dots_of = [](std::vector<Sample> samples) {
    RunChart chart = run_of(std::move(samples));
    chart.levels.clear();
    std::size_t dots = 0;
    for (const auto& line : lines_of(part_of(run_chart(chart), "dots"))) {
      for (const auto& [x, y] : line) {
        CHECK(x >= 0);
        CHECK(x <= 900);
        CHECK(y >= 0);
        CHECK(y <= 400);
      }
      ++dots;
    }
    return dots - 1;  // the legend has one
  };
  CHECK(dots_of({{0, 2.7}}) == 1);
  CHECK(dots_of({{1, 2.7}, {2, 2.7}, {3, 2.7}}) == 3);
  CHECK(dots_of({{1, 0}, {2, 0}}) == 2);
  CHECK(dots_of({{1, 1e300}, {2, -1e300}, {3, 1e-300}}) == 3);
  CHECK(dots_of({{1, 1e15}, {2, 1e15 + 1}}) == 2);
  CHECK(dots_of({{std::numeric_limits<std::int64_t>::min(), 1},
                 {std::numeric_limits<std::int64_t>::max(), 2}}) == 2);
}

TEST_CASE("chart: lines break where results are missing or a run begins") {
  const auto lines_drawn = [](const RunChart& chart) {
    return lines_of(part_of(run_chart(chart), "course")).size() - 1;  // the legend has one
  };
  RunChart chart = run_of(samples_of(10));
  CHECK(lines_drawn(chart) == 1);
  chart.gaps = {{3, 4, 7}};
  CHECK(lines_drawn(chart) == 2);
  chart.samples[7].is_first = true;
  CHECK(lines_drawn(chart) == 3);
  // The run begins with an NG result: the line still breaks.
  chart.samples[7].is_ng = true;
  CHECK(lines_drawn(chart) == 3);
  const std::string figure = run_chart(chart);
  CHECK(contains(figure, ">7 missed<"));
  CHECK(contains(figure, ">7 missed in 1 gap<"));
}

TEST_CASE("chart: levels are named with their value and origin") {
  const RunChart chart = run_of(samples_of(50));
  const std::string wide = run_chart(chart, Format::wide);
  for (const char* text : {">USL 2.98<", ">LSL 2.44<", ">target 2.71<", ">mean 2.713<"}) {
    CHECK_MESSAGE(contains(wide, text), text);
  }
  CHECK(count_of(wide, ">tool&#39;s own<") == 2);
  const std::string narrow = run_chart(chart, Format::narrow);
  CHECK(contains(narrow, ">USL 2.98<"));
  CHECK(contains(narrow, ">USL, LSL: tool&#39;s own<"));
}

TEST_CASE("chart: a level ends where it no longer holds") {
  RunChart chart = run_of(samples_of(101));
  chart.levels = {{LevelKind::specification_limit, 2.98, "USL", "old", std::nullopt, 50},
                  {LevelKind::specification_limit, 3.10, "USL", "new", 50}};
  const auto lines = lines_of(part_of(run_chart(chart), "limit"));
  REQUIRE(lines.size() == 2);
  CHECK(lines[0][1].first == doctest::Approx(lines[1][0].first));
  CHECK(lines[0][0].first < lines[0][1].first);
  CHECK(lines[1][0].second < lines[0][0].second);
  // Beside its end, not in the margin.
  CHECK(contains(run_chart(chart), " text-anchor=\"end\">USL 2.98<"));
  CHECK(contains(run_chart(chart), "\">USL 3.10<"));
  CHECK(!contains(run_chart(chart), " text-anchor=\"end\">USL 3.10<"));
}

TEST_CASE("chart: words along the top stay apart, and what is left out is counted") {
  RunChart chart = run_of(samples_of(101));
  chart.changes = {{20, "settings changed"}, {22, "firmware"}, {60, "settings changed"}};
  const std::string few = run_chart(chart);
  CHECK(count_of(few, ">settings changed<") == 2);
  CHECK(contains(few, ">firmware<"));
  CHECK(!contains(few, ">3 changes<"));
  // What is missing is said in the legend too, so its words give way.
  chart.gaps = {{21, 22, 5}, {23, 24, 6}};
  CHECK(contains(run_chart(chart), ">11 missed in 2 gaps<"));
  CHECK(count_of(run_chart(chart), " missed<") == 0);
  CHECK(count_of(run_chart(chart), ">settings changed<") == 2);
  CHECK(contains(run_chart(chart), ">firmware<"));
  for (std::int64_t at = 0; at < 100; ++at) chart.changes.push_back({at, "settings changed"});
  const std::string many = run_chart(chart);
  CHECK(count_of(many, ">settings changed<") < 20);
  CHECK(contains(many, ">103 changes<"));
}

TEST_CASE("chart: a time axis names its zone, and the description the time") {
  RunChart chart = run_of({{start, 2.7}, {start + hour, 2.8}});
  chart.course = {.along = Along::time, .utc_offset_minutes = 60};
  const std::string figure = run_chart(chart);
  CHECK(contains(figure, ">Time (UTC+01:00)<"));
  CHECK(contains(figure, ">08:00<"));
  CHECK(contains(figure, ">2026-03-12<"));
  CHECK(contains(figure, "From 2026-03-12 08:00:00 +01:00 to 2026-03-12 09:00:00 +01:00."));
}

TEST_CASE("chart: signals carry the number of their rule") {
  ControlChart chart = control_of(100);
  chart.values.points[10].signal = 1;
  for (std::size_t at = 50; at < 55; ++at) chart.values.points[at].signal = 4;
  chart.baseline = Baseline{0, 25, "baseline: results 1 to 25"};
  const std::string figure = control_chart(chart);
  CHECK(contains(part_of(figure, "signal-word"), ">1<"));
  // A run has its number once where there is no room for more.
  CHECK(count_of(part_of(figure, "signal-word"), ">4<") == 1);
  CHECK(contains(figure, ">1 signal by rule 1<"));
  CHECK(contains(figure, ">5 signals by rule 4<"));
  CHECK(contains(figure, ">baseline: results 1 to 25<"));
  // Two panels and the legend.
  CHECK(count_of(part_of(figure, "baseline"), "<rect") == 3);
  chart.doubt = "lag-1 autocorrelation 0.31";
  const std::string doubtful = control_chart(chart);
  CHECK(part_of(doubtful, "signal-word").empty());
  CHECK(contains(part_of(doubtful, "doubtful-word"), ">1<"));
  CHECK(contains(doubtful, ">lag-1 autocorrelation 0.31<"));
}

TEST_CASE("chart: classes lie half a step beside their values") {
  Histogram chart = histogram_of({{5, 0}, {7, 2}});
  chart.steps_per_class = 2;
  chart.below = 3;
  const std::string figure = histogram(chart);
  CHECK(contains(figure, ">15 values, classes of 0.02 N.m<"));
  CHECK(contains(figure, ">of these 2 NG<"));
  CHECK(contains(figure, ">3 more below<"));
  CHECK(!contains(figure, "normal curve"));
  CHECK(part_of(figure, "normal").empty());
  // Two bars and the legend; the limits at 2.44 and 2.98 are the scale: 2.595 to 2.635.
  const std::string bars = part_of(figure, "bar");
  const auto left = attributes(bars, "x");
  const auto width = attributes(bars, "width");
  REQUIRE(left.size() == 3);
  const auto limit = lines_of(part_of(figure, "limit"));
  const double high = limit[0][0].first;
  const double low = limit[1][0].first;
  const auto value = [&](double x) { return 2.44 + (x - low) / (high - low) * 0.54; };
  CHECK(value(std::stod(left[0]) - 1) == doctest::Approx(2.595).epsilon(0.0002));
  CHECK(value(std::stod(left[1]) + std::stod(width[1]) + 1) ==
        doctest::Approx(2.635).epsilon(0.0002));
  // However narrow the curve, the bars stay visible: the highest a third of the plot.
  const auto height_of = [](const std::string& text) {
    double highest = 0;
    for (const std::string& height : attributes(part_of(text, "bar"), "height")) {
      highest = std::max(highest, std::stod(height));
    }
    return highest;
  };
  chart.normal = NormalCurve{2.61, 1e-9};
  CHECK(height_of(histogram(chart)) > 0.3 * 230);
  chart.normal = NormalCurve{2.61, 0.02};
  CHECK(contains(histogram(chart), ">normal curve: mean 2.610, s 0.0200<"));
  CHECK(contains(part_of(histogram(chart), "normal"), "stroke-dasharray"));
}

TEST_CASE("chart: causes are ordered, cumulated, and the rare ones are one bar") {
  Pareto chart{
      {"NG"}, "NG results", {{"E330", "angle", 2}, {"E333", "released", 11}, {"E335", "", 4}}};
  const std::string figure = pareto(chart);
  CHECK(figure.find(">E333  released<") < figure.find(">E335<"));
  CHECK(figure.find(">E335<") < figure.find(">E330  angle<"));
  CHECK(contains(figure, ">11 (64.7 %)<"));
  CHECK(contains(figure, ">100 % = 17 NG results<"));
  const auto line = lines_of(part_of(figure, "course"));
  REQUIRE(line[0].size() == 3);
  const double left = std::stod(attributes(part_of(figure, "ng-bar"), "x")[0]);
  CHECK((line[0][1].first - left) / (line[0][2].first - left) ==
        doctest::Approx(15.0 / 17).epsilon(0.001));
  for (int at = 0; at < 30; ++at) chart.causes.push_back({fmt::format("E{}", at), "", 1});
  const std::string many = pareto(chart);
  CHECK(contains(many, ">22 other codes<"));
  CHECK(contains(many, ">22 (46.8 %)<"));
  CHECK(count_of(part_of(many, "ng-bar"), "<rect") == 13);  // with the legend
}

TEST_CASE("chart: NG curves are drawn last, dashed and with their names") {
  Curves chart = curves_of(3);
  chart.curves[0].is_ng = true;
  chart.steps = {{800, "snug"}};
  chart.levels = limits;
  const std::string figure = curves(chart);
  CHECK(figure.find("<g class=\"chart-ng-curve\"") > figure.rfind("<g class=\"chart-curve\""));
  CHECK(contains(part_of(figure, "ng-curve"), "stroke-dasharray"));
  CHECK(contains(figure, ">NG 1024<"));
  CHECK(contains(figure, ">snug<"));
  CHECK(contains(figure, ">2 OK<"));
  CHECK(contains(figure, ">1 NG<"));
}

TEST_CASE("chart: a curve keeps its peak however many points it has") {
  Curves chart = curves_of(0);
  Curve curve;
  for (int at = 0; at < 100'000; ++at) {
    curve.points.push_back({.x = at * 0.01, .y = at == 54'321 ? 9.0 : 0.001 * (at % 7)});
  }
  chart.curves = {curve};
  const std::string figure = curves(chart);
  CHECK(figure.size() < 40'000);
  const auto corners = lines_of(part_of(figure, "curve"))[0];
  double top = 1e9;
  double bottom = 0;
  double peak = 0;
  for (const auto& [x, y] : corners) {
    bottom = std::max(bottom, y);
    if (y < top) peak = x;
    top = std::min(top, y);
  }
  CHECK(bottom - top == doctest::Approx(230 / 1.1).epsilon(0.01));
  CHECK((peak - corners.front().first) / (corners.back().first - corners.front().first) ==
        doctest::Approx(0.54321).epsilon(0.002));
}

TEST_CASE("chart: hundreds of curves make a small file") {
  CHECK(curves(curves_of(300)).size() < 40'000);
}

TEST_CASE("chart: the style asks for nothing and knows print and phones") {
  const std::string css(style());
  CHECK(contains(css, "@media print"));
  CHECK(contains(css, "max-width"));
  for (const std::string_view asked : {"url(", "@import", "http", "<", "&"}) {
    CHECK(!contains(css, asked));
  }
  CHECK(count_of(css, "{") == count_of(css, "}"));
  const std::string both = pair(run_chart(run_of(samples_of(9)), Format::wide),
                                run_chart(run_of(samples_of(9)), Format::narrow));
  CHECK(fault_of(both) == "");
  CHECK(count_of(both, "class=\"chart chart-wide\"") == 1);
  CHECK(count_of(both, "class=\"chart chart-narrow\"") == 1);
}

TEST_CASE("chart: NG results alone have a scale of their own") {
  RunChart chart = run_of({{1, 2.7, true}, {2, 1.7, true}, {3, 2.7, true}});
  chart.levels.clear();
  CHECK(crosses_in(run_chart(chart)) == 3);
  CHECK(arrows_in(run_chart(chart)) == 0);
}

TEST_CASE("chart: words never cover each other") {
  const std::string figure = run_chart(run_of(samples_of(50)));
  const double mean = std::stod(attributes(part_of(figure, "mean-word"), "y").at(0));
  const double target = std::stod(attributes(part_of(figure, "target-word"), "y").at(0));
  CHECK(std::abs(mean - target) >= letter_height);

  // The last label would be cut off at the edge, or cover the one before.
  RunChart one{.caption = {}, .quantity = torque, .samples = {{start, 2.7}}};
  one.course.along = Along::time;
  CHECK(contains(run_chart(one), ">07:00:25<"));
  CHECK(!contains(run_chart(one), ">07:00:30<"));

  ControlChart control = control_of(300);
  control.values.points[10] = {10, 2.9, 1};
  control.values.points[11] = {11, 2.9, 1};
  CHECK(count_of(part_of(control_chart(control), "signal-word"), ">1<") == 1);

  // The numbers of all classes or of none.
  Histogram few = histogram_of({{5, 0}, {123, 0}});
  few.steps_per_class = 5;
  CHECK(contains(part_of(histogram(few), "word"), ">5<"));
  std::vector<HistogramClass> many(200, {123, 0});
  many[7].count = 5;
  CHECK(!contains(part_of(histogram(histogram_of(many)), "word"), ">5<"));
}
