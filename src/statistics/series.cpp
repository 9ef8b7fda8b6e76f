#include "spindle/statistics/series.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace spindle::statistics {

std::optional<Series> Series::of(std::span<const double> values,
                                 std::span<const std::size_t> breaks) {
  const auto is_measured = [](double value) { return std::abs(value) <= largest; };
  if (!std::all_of(values.begin(), values.end(), is_measured)) return std::nullopt;

  std::vector<std::size_t> begins = {0};
  for (const std::size_t index : breaks) {
    if (index < values.size()) begins.push_back(index);
  }
  std::sort(begins.begin(), begins.end());
  begins.push_back(values.size());

  std::vector<IndexRange> segments;
  for (std::size_t at = 0; at + 1 < begins.size(); ++at) {
    const IndexRange segment{.first = begins[at], .count = begins[at + 1] - begins[at]};
    if (segment.count > 0) segments.push_back(segment);
  }
  return Series(values, std::move(segments));
}

Series::Series(std::span<const double> values, std::vector<IndexRange> segments)
    : values_(values), segments_(std::move(segments)) {}

Series Series::part(IndexRange range) const {
  const std::size_t first = std::min(range.first, size());
  const std::size_t end = first + std::min(range.count, size() - first);
  std::vector<IndexRange> segments;
  for (const IndexRange& segment : segments_) {
    const std::size_t from = std::max(segment.first, first);
    const std::size_t to = std::min(segment.end(), end);
    if (from < to) segments.push_back({.first = from - first, .count = to - from});
  }
  return Series(values_.subspan(first, end - first), std::move(segments));
}

}  // namespace spindle::statistics
