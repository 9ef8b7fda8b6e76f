#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

#include "spindle/statistics/moments.hpp"
#include "spindle/statistics/rules.hpp"
#include "spindle/statistics/series.hpp"

namespace spindle::statistics {

/// What the values are to keep to: the joint's limits or the tool's own. Never control limits.
struct Specification {
  std::optional<double> lower = {};
  std::optional<double> upper = {};

  /// Whether there is a limit, each is a number, and the lower one is the smaller one. Without,
  /// there is no index.
  bool is_usable() const;
};

enum class IndexName : std::uint8_t { ppk, ppu, ppl, cpk, cpu, cpl, cmk, cmu, cml };

/// "Ppk", "Ppu", …
std::string_view to_text(IndexName name);

/// An index with its 95 % bounds: value +- 1.96 sqrt(1 / (9 n) + value^2 / (2 v)) (Bissell 1990),
/// where the deviation has v degrees of freedom: n - 1 of s, 0.62 as many as there are moving
/// ranges of sigma_within.
struct Index {
  IndexName name = IndexName::ppk;
  double value = 0;
  double low = 0;
  double high = 0;
};

/// What a number of values is enough for.
enum class Amount : std::uint8_t {
  too_few,  ///< below 30: no index
  few,      ///< below 50: not without a remark
  enough,   ///< below 125
  full,
};

Amount amount_of(std::size_t count);

/// One family of indices. By two limits `centred` (Pp, Cp, Cm) is (U - L) / (6 d), and `index` is
/// min(U - mean, mean - L) / (3 d), by name ppk, cpk or cmk; by one limit `index` is that of this
/// limit alone, by name ppu or ppl and so on, and there is no `centred`. Both are nothing below 30
/// values, without a usable specification, and when d is 0.
struct Indices {
  std::size_t count = 0;
  Amount amount = Amount::too_few;
  std::optional<double> centred = {};  ///< what `index` is if the mean is in the middle
  std::optional<Index> index = {};
};

/// Pp and Ppk: d is s of all values.
Indices performance(const Moments& moments, const Specification& specification);

/// Cp and Cpk: d is within_deviation(), which says what the process could do only while it is
/// stable. Nothing for another verdict.
std::optional<Indices> capability(const Series& series, const Specification& specification,
                                  const Stability& stability);

/// Ppk that expects no normal distribution (ISO 22514-2): the smaller one of (U - M) / (P99.865 -
/// M) and (M - L) / (M - P0.135), with the median M; of one limit alone where there is one.
/// Quantiles are interpolated between neighbours, the i-th of n values being at (i - 1) / (n - 1).
struct PercentileIndex {
  IndexName name = IndexName::ppk;
  double value = 0;
  bool differs = false;  ///< by more than 10 % from the normal one: to be shown beside it
};

/// `normal` is the performance() of the same values. Nothing below 1,000 values, without a usable
/// specification, and where a tail has no width.
std::optional<PercentileIndex> percentile_performance(const Series& series,
                                                      const Specification& specification,
                                                      const Indices& normal);

/// The longest stretch without an interruption, the last one of several, when it has 50 values or
/// more: what a study of the machine (Cm, Cmk) may be computed from. It is told only when asked
/// for.
std::optional<IndexRange> machine_run(const Series& series);

/// Cm and Cmk of the machine_run(). Nothing without one.
std::optional<Indices> machine_performance(const Series& series,
                                           const Specification& specification);

}  // namespace spindle::statistics
