#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace spindle::statistics {

/// Neighbouring values of a series: `count` of them from index `first` on.
struct IndexRange {
  std::size_t first = 0;
  std::size_t count = 0;

  std::size_t end() const { return first + count; }
  bool operator==(const IndexRange&) const = default;
};

/// The values of one stratum in order of time, and where their order is interrupted: by a gap in
/// the numbering, a restart, a change of settings, a pause. Looks at values that live elsewhere.
/// Removes nothing: leaving a value out is the caller's business, who must name it.
class Series {
 public:
  /// Sums of fourth powers of a million values up to this stay finite.
  static constexpr double largest = 1e60;

  /// `breaks`: the indices before which the order is interrupted, so that the value at the index
  /// has no neighbour on its left; in any order, and those outside of the series are ignored.
  /// Nothing when one of the values is not a number or is beyond `largest`: such a value was not
  /// measured.
  static std::optional<Series> of(std::span<const double> values,
                                  std::span<const std::size_t> breaks = {});

  std::span<const double> values() const { return values_; }
  std::size_t size() const { return values_.size(); }
  double operator[](std::size_t index) const { return values_[index]; }
  /// The stretches without an interruption, in order; together they are the series.
  std::span<const IndexRange> segments() const { return segments_; }
  /// A part of the series as a series of its own; what lies outside of the series is ignored.
  Series part(IndexRange range) const;

 private:
  Series(std::span<const double> values, std::vector<IndexRange> segments);

  std::span<const double> values_;
  std::vector<IndexRange> segments_ = {};
};

}  // namespace spindle::statistics
