#include "spindle/statistics/counts.hpp"

#include <algorithm>
#include <cmath>

#include "statistics/distributions.hpp"

namespace spindle::statistics {

std::optional<Yield> yield_of(std::size_t ok, std::size_t ng) {
  if (ok == 0 && ng == 0) return std::nullopt;
  const double n = static_cast<double>(ok) + static_cast<double>(ng);
  const double share = static_cast<double>(ok) / n;
  const double square = normal_95 * normal_95;
  const double middle = (share + square / (2 * n)) / (1 + square / n);
  const double swing =
      normal_95 / (1 + square / n) * std::sqrt(share * (1 - share) / n + square / (4 * n * n));
  constexpr double million = 1e6;
  return Yield{.ok = ok,
               .ng = ng,
               .share = share,
               .low = ok == 0 ? 0 : middle - swing,
               .high = ng == 0 ? 1 : middle + swing,
               .ng_ppm = static_cast<double>(ng) / n * million};
}

std::vector<ParetoRow> pareto(std::span<const KeyCount> counts) {
  std::vector<ParetoRow> rows;
  std::size_t all = 0;
  for (const auto& [key, count] : counts) {
    if (count > 0) rows.push_back({.key = key, .count = count});
    all += count;
  }
  std::stable_sort(rows.begin(), rows.end(),
                   [](const ParetoRow& a, const ParetoRow& b) { return a.count > b.count; });
  std::size_t above = 0;
  const auto percent = [&](std::size_t count) {
    return 100 * static_cast<double>(count) / static_cast<double>(all);
  };
  for (ParetoRow& row : rows) {
    above += row.count;
    row.percent = percent(row.count);
    row.cumulated = percent(above);
  }
  return rows;
}

}  // namespace spindle::statistics
