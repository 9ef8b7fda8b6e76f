#include "spindle/statistics/capability.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "spindle/statistics/chart.hpp"
#include "spindle/statistics/moments.hpp"
#include "statistics/distributions.hpp"

namespace spindle::statistics {
namespace {

constexpr std::size_t least_for_index = 30;
constexpr std::size_t least_without_remark = 50;
constexpr std::size_t least_for_full = 125;
constexpr std::size_t least_for_percentiles = 1000;
constexpr std::size_t least_for_machine = 50;

/// The names of one family.
struct Names {
  IndexName both;
  IndexName upper;
  IndexName lower;
};

constexpr Names of_performance = {IndexName::ppk, IndexName::ppu, IndexName::ppl};
constexpr Names of_capability = {IndexName::cpk, IndexName::cpu, IndexName::cpl};
constexpr Names of_machine = {IndexName::cmk, IndexName::cmu, IndexName::cml};

/// Which limits there are decides what an index is called.
IndexName name_of(const Specification& specification, const Names& names) {
  if (!specification.lower) return names.upper;
  return specification.upper ? names.both : names.lower;
}

/// The smaller distance between `middle` and a limit, in widths of that side.
double least_distance(const Specification& specification, double middle, double lower_width,
                      double upper_width) {
  double least = std::numeric_limits<double>::infinity();
  if (specification.upper) least = (*specification.upper - middle) / upper_width;
  if (specification.lower) least = std::min(least, (middle - *specification.lower) / lower_width);
  return least;
}

/// A deviation and the degrees of freedom that it was estimated with.
struct Deviation {
  std::optional<double> value;
  double freedom;
};

Indices indices_of(const Moments& moments, const Deviation& deviation,
                   const Specification& specification, const Names& names) {
  Indices result{.count = moments.count(), .amount = amount_of(moments.count())};
  const double d = deviation.value.value_or(0);
  if (result.amount == Amount::too_few || !specification.is_usable() || d <= 0) return result;
  const double value = least_distance(specification, moments.mean().value_or(0), 3 * d, 3 * d);
  const auto n = static_cast<double>(moments.count());
  const double swing = normal_95 * std::sqrt(1 / (9 * n) + value * value / (2 * deviation.freedom));
  const double centred =
      (specification.upper.value_or(0) - specification.lower.value_or(0)) / (6 * d);
  // A deviation may be so small that they are beyond any number.
  if (!std::isfinite(centred) || !std::isfinite(swing)) return result;
  result.index = Index{.name = name_of(specification, names),
                       .value = value,
                       .low = value - swing,
                       .high = value + swing};
  if (specification.lower && specification.upper) result.centred = centred;
  return result;
}

Indices of_all(const Moments& moments, const Specification& specification, const Names& names) {
  const Deviation s{.value = moments.deviation(),
                    .freedom = static_cast<double>(moments.count()) - 1};
  return indices_of(moments, s, specification, names);
}

/// The values below which these shares of the values lie; the shares ascend.
std::array<double, 3> quantiles(std::vector<double> values, const std::array<double, 3>& shares) {
  std::array<double, 3> found = {};
  auto from = values.begin();
  for (std::size_t which = 0; which < shares.size(); ++which) {
    const double position = shares[which] * static_cast<double>(values.size() - 1);
    const auto at = values.begin() + static_cast<std::ptrdiff_t>(position);
    // Those below `from` are the smallest ones already.
    std::nth_element(from, at, values.end());
    const double next = at + 1 == values.end() ? *at : *std::min_element(at + 1, values.end());
    found[which] = *at + (position - std::floor(position)) * (next - *at);
    from = at;
  }
  return found;
}

}  // namespace

bool Specification::is_usable() const {
  const auto is_number = [](const std::optional<double>& limit) {
    return !limit || std::abs(*limit) <= Series::largest;
  };
  if (!is_number(lower) || !is_number(upper)) return false;
  return lower && upper ? *lower < *upper : lower || upper;
}

std::string_view to_text(IndexName name) {
  switch (name) {
    case IndexName::ppk:
      return "Ppk";
    case IndexName::ppu:
      return "Ppu";
    case IndexName::ppl:
      return "Ppl";
    case IndexName::cpk:
      return "Cpk";
    case IndexName::cpu:
      return "Cpu";
    case IndexName::cpl:
      return "Cpl";
    case IndexName::cmk:
      return "Cmk";
    case IndexName::cmu:
      return "Cmu";
    case IndexName::cml:
      return "Cml";
  }
  return {};
}

Amount amount_of(std::size_t count) {
  if (count < least_for_index) return Amount::too_few;
  if (count < least_without_remark) return Amount::few;
  return count < least_for_full ? Amount::enough : Amount::full;
}

Indices performance(const Moments& moments, const Specification& specification) {
  return of_all(moments, specification, of_performance);
}

std::optional<Indices> capability(const Series& series, const Specification& specification,
                                  const Stability& stability) {
  if (stability.verdict != Verdict::stable) return std::nullopt;
  constexpr double freedom_per_range = 0.62;
  const auto ranges = static_cast<double>(moving_range(series).ranges);
  const Deviation within{.value = within_deviation(series), .freedom = freedom_per_range * ranges};
  return indices_of(moments_of(series.values()), within, specification, of_capability);
}

std::optional<PercentileIndex> percentile_performance(const Series& series,
                                                      const Specification& specification,
                                                      const Indices& normal) {
  if (series.size() < least_for_percentiles || !normal.index) return std::nullopt;
  constexpr double tail = 0.00135;
  const auto [low, median, high] =
      quantiles({series.values().begin(), series.values().end()}, {tail, 0.5, 1 - tail});
  const double lower_width = median - low;
  const double upper_width = high - median;
  if ((specification.lower && lower_width <= 0) || (specification.upper && upper_width <= 0)) {
    return std::nullopt;
  }
  const double value = least_distance(specification, median, lower_width, upper_width);
  if (!std::isfinite(value)) return std::nullopt;
  constexpr double noticed = 0.1;
  return PercentileIndex{
      .name = normal.index->name,
      .value = value,
      .differs = std::abs(value - normal.index->value) > noticed * std::abs(normal.index->value)};
}

std::optional<IndexRange> machine_run(const Series& series) {
  std::optional<IndexRange> longest;
  for (const IndexRange& segment : series.segments()) {
    const std::size_t least = longest ? longest->count : least_for_machine;
    if (segment.count >= least) longest = segment;
  }
  return longest;
}

std::optional<Indices> machine_performance(const Series& series,
                                           const Specification& specification) {
  const std::optional<IndexRange> run = machine_run(series);
  if (!run) return std::nullopt;
  return of_all(moments_of(series.part(*run).values()), specification, of_machine);
}

}  // namespace spindle::statistics
