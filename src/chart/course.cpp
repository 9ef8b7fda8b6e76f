#include "course.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "spindle/base/text.hpp"
#include "text.hpp"

namespace spindle::chart {
namespace {

// The years 1 to 9999; numbers that a double holds apart.
constexpr std::int64_t earliest = -62'135'596'800'000;
constexpr std::int64_t latest = 253'402'300'799'999;
constexpr std::int64_t last_index = 1'000'000'000'000'000;

// Above this many samples a column of pixels, a line is a wall.
constexpr double most_per_column = 2;
// Up to this many a column, each has a dot that is seen as one.
constexpr double most_dots_per_column = 0.2;
// So many empty columns are a pause, not chance.
constexpr std::size_t columns_of_pause = 5;

constexpr double narrowest_blank = 3;

bool is_good(const Sample& sample) { return !sample.is_ng && std::isfinite(sample.value); }

/// Of gaps in the order of their ends.
bool lies_between(std::span<const Gap> gaps, std::int64_t from, std::int64_t to) {
  const auto gap = std::partition_point(gaps.begin(), gaps.end(),
                                        [&](const Gap& before) { return before.to <= from; });
  return gap != gaps.end() && gap->from < to;
}

void draw_line(Svg& svg, std::span<const Sample> samples, std::span<const Gap> gaps, const Scale& x,
               const Scale& y) {
  Path line;
  Path dots;
  const Sample* before = nullptr;
  bool begins = true;
  std::size_t count = 0;
  for (const Sample& sample : samples) {
    begins = begins || sample.is_first;
    if (!is_good(sample)) continue;
    const double to_x = x(static_cast<double>(sample.at));
    const double to_y = y(bounded(sample.value));
    if (begins || lies_between(gaps, before->at, sample.at)) {
      line.move(to_x, to_y);
    } else {
      line.line(to_x, to_y);
    }
    dots.dot(to_x, to_y);
    before = &sample;
    begins = false;
    ++count;
  }
  svg.path(Look::course, line);
  const bool is_sparse = static_cast<double>(count) <= most_dots_per_column * (x.end - x.begin);
  svg.path(is_sparse ? Look::dots : Look::small_dots, dots);
}

/// Columns without a pause between them.
struct Stretch {
  std::vector<double> x;
  std::vector<Column> columns;
};

std::vector<Stretch> stretches_of(const std::vector<Column>& columns, double left) {
  std::vector<Stretch> stretches;
  std::size_t empty = columns_of_pause;
  for (std::size_t at = 0; at < columns.size(); ++at) {
    if (columns[at].count == 0) {
      ++empty;
      continue;
    }
    if (empty >= columns_of_pause) stretches.emplace_back();
    empty = 0;
    stretches.back().x.push_back(left + static_cast<double>(at) + 0.5);
    stretches.back().columns.push_back(columns[at]);
  }
  return stretches;
}

void draw_band(Svg& svg, const std::vector<Column>& columns, const Scale& x, const Scale& y) {
  Path band;
  Path means;
  for (const Stretch& stretch : stretches_of(columns, x.begin)) {
    const std::size_t size = stretch.x.size();
    band.move(stretch.x[0], y(stretch.columns[0].high));
    for (std::size_t at = 1; at < size; ++at) {
      band.line(stretch.x[at], y(stretch.columns[at].high));
    }
    for (std::size_t at = size; at-- > 0;) band.line(stretch.x[at], y(stretch.columns[at].low));
    band.close();
    for (std::size_t at = 0; at < size; ++at) {
      const Column& column = stretch.columns[at];
      const double mean = y(column.sum / static_cast<double>(column.count));
      if (at == 0) {
        means.move(stretch.x[at], mean);
      } else {
        means.line(stretch.x[at], mean);
      }
    }
  }
  svg.path(Look::band, band);
  svg.path(Look::course, means);
}

}  // namespace

std::vector<Column> columns_of(std::span<const Sample> samples, const Scale& x) {
  const double width = std::max(1.0, std::floor(x.end - x.begin));
  std::vector<Column> columns(static_cast<std::size_t>(width));
  for (const Sample& sample : samples) {
    if (!is_good(sample)) continue;
    const double place = x(static_cast<double>(sample.at)) - x.begin;
    const double value = bounded(sample.value);
    Column& column = columns[static_cast<std::size_t>(std::clamp(place, 0.0, width - 1))];
    column.low = column.count == 0 ? value : std::min(column.low, value);
    column.high = column.count == 0 ? value : std::max(column.high, value);
    column.sum += value;
    ++column.count;
  }
  return columns;
}

std::vector<Spot> thinned(std::vector<Spot> spots, std::size_t most, const Box& box) {
  for (double cell = 1; spots.size() > most; cell *= 2) {
    const auto across = static_cast<std::size_t>(std::max(0.0, box.width() / cell)) + 1;
    const auto down = static_cast<std::size_t>(std::max(0.0, box.height() / cell)) + 1;
    std::vector<bool> taken(across * down, false);
    const auto place = [cell](double from, double to, std::size_t count) {
      return std::min(static_cast<std::size_t>(std::max(0.0, (to - from) / cell)), count - 1);
    };
    std::erase_if(spots, [&](const Spot& spot) {
      const std::size_t at =
          place(box.top, spot.y, down) * across + place(box.left, spot.x, across);
      const bool was_taken = taken[at];
      taken[at] = true;
      return was_taken;
    });
    if (across * down == 1) break;
  }
  return spots;
}

std::int64_t bounded_place(std::int64_t at, Along along) {
  if (along == Along::time) return std::clamp(at, earliest, latest);
  return std::clamp(at, -last_index, last_index);
}

void Span::add(std::int64_t at) {
  low = is_empty ? at : std::min(low, at);
  high = is_empty ? at : std::max(high, at);
  is_empty = false;
}

std::vector<Blank> blanks_of(std::span<const Gap> gaps, const Course& course, const Scale& x) {
  std::vector<Blank> blanks;
  for (const Gap& gap : gaps) {
    const double from = x(static_cast<double>(bounded_place(gap.from, course.along)));
    const double to = x(static_cast<double>(bounded_place(gap.to, course.along)));
    const double more = std::max(0.0, narrowest_blank - (to - from)) / 2;
    blanks.push_back({.left = from - more, .right = to + more, .missed = gap.missed});
  }
  std::stable_sort(blanks.begin(), blanks.end(),
                   [](const Blank& a, const Blank& b) { return a.left < b.left; });
  std::vector<Blank> joined;
  for (const Blank& blank : blanks) {
    if (joined.empty() || blank.left > joined.back().right + 1) {
      joined.push_back(blank);
      continue;
    }
    joined.back().right = std::max(joined.back().right, blank.right);
    joined.back().missed += blank.missed;
  }
  return joined;
}

Drawn draw_samples(Svg& svg, std::span<const Sample> samples, std::span<const Gap> gaps,
                   const Scale& x, const Scale& y) {
  const auto good = std::count_if(samples.begin(), samples.end(), is_good);
  if (static_cast<double>(good) <= most_per_column * (x.end - x.begin)) {
    std::vector<Gap> in_order(gaps.begin(), gaps.end());
    std::stable_sort(in_order.begin(), in_order.end(),
                     [](const Gap& a, const Gap& b) { return a.to < b.to; });
    draw_line(svg, samples, in_order, x, y);
    return Drawn::line;
  }
  draw_band(svg, columns_of(samples, x), x, y);
  return Drawn::band;
}

void draw_blanks(Svg& svg, std::span<const Blank> blanks, const Box& box) {
  // Hatching of many areas would take more room in the file than all values.
  constexpr std::size_t most_hatched = 40;
  constexpr double narrowest_hatched = 6;
  Path hatch;
  for (const Blank& blank : blanks) {
    const Box area{.left = std::max(box.left, blank.left),
                   .top = box.top,
                   .right = std::min(box.right, blank.right),
                   .bottom = box.bottom};
    svg.rectangle(Look::gap, area);
    if (area.width() < narrowest_hatched || blanks.size() > most_hatched) continue;
    const Path lines = hatching(area, 8);
    svg.path(Look::hatch, lines);
  }
}

std::vector<MarginWord> level_words(std::span<const Level> levels, const Quantity& quantity) {
  std::vector<MarginWord> words;
  for (const Level& level : levels) {
    if (!std::isfinite(level.value)) continue;
    words.push_back({.y = 0,
                     .look = word_look(level.kind),
                     .text = level_text(level, quantity),
                     .detail = level.origin});
  }
  return words;
}

std::vector<MarginWord> draw_levels(Svg& svg, std::span<const Level> levels,
                                    const Quantity& quantity, const Course& course, const Box& box,
                                    const Scale& x, const Scale& y) {
  std::vector<MarginWord> words;
  struct Inside {
    double x, y;
    Look look;
    std::string text;
  };
  std::vector<Inside> inside;
  for (const Level& level : levels) {
    if (!std::isfinite(level.value)) continue;
    const auto place = [&](std::int64_t at) {
      const double to = x(static_cast<double>(bounded_place(at, course.along)));
      return std::clamp(to, box.left, box.right);
    };
    const double left = level.from ? place(*level.from) : box.left;
    const double right = level.to ? place(*level.to) : box.right;
    const double height = y(bounded(level.value));
    svg.line(line_look(level.kind), left, height, right, height);
    std::string text = level_text(level, quantity);
    if (right < box.right - 7) {
      if (text_width(text) > right - left) continue;
      inside.push_back({right - 3, height - 4, word_look(level.kind), std::move(text)});
    } else {
      words.push_back({.y = height,
                       .look = word_look(level.kind),
                       .text = std::move(text),
                       .detail = level.origin});
    }
  }
  for (const Inside& word : inside) svg.text(word.look, word.x, word.y, Anchor::end, word.text);
  return words;
}

TopWords top_words(std::span<const Change> changes, std::span<const Blank> blanks,
                   const Course& course, const Scale& x) {
  TopWords words;
  for (const Change& change : changes) {
    words.add(x(static_cast<double>(bounded_place(change.at, course.along))), Look::change_word,
              change.word);
  }
  for (const Blank& blank : blanks) {
    words.add_optional(blank.left, Look::change_word, grouped(blank.missed) + " missed");
  }
  return words;
}

void draw_changes(Svg& svg, std::span<const Change> changes, const Course& course, const Scale& x,
                  const Box& box) {
  std::vector<double> places;
  for (const Change& change : changes) {
    places.push_back(std::round(x(static_cast<double>(bounded_place(change.at, course.along)))));
  }
  std::sort(places.begin(), places.end());
  places.erase(std::unique(places.begin(), places.end()), places.end());
  for (const double place : places) svg.line(Look::change, place, box.top, place, box.bottom);
}

std::string missed_text(std::span<const Gap> gaps) {
  std::uint64_t missed = 0;
  for (const Gap& gap : gaps) missed += gap.missed;
  return fmt::format("{} missed in {}", grouped(missed), counted(gaps.size(), "gap"));
}

}  // namespace spindle::chart
