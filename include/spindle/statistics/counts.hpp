#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace spindle::statistics {

/// Share of the good ones among all that were judged, with the 95 % interval of Wilson (1927).
struct Yield {
  std::size_t ok = 0;
  std::size_t ng = 0;
  double share = 0;  ///< ok / (ok + ng), 0 to 1
  double low = 0;
  double high = 0;
  double ng_ppm = 0;  ///< counted, never from a fitted tail
};

/// Nothing where nothing was judged.
std::optional<Yield> yield_of(std::size_t ok, std::size_t ng);

struct KeyCount {
  std::string key = {};
  std::size_t count = 0;
};

struct ParetoRow {
  std::string key = {};
  std::size_t count = 0;
  double percent = 0;    ///< of all
  double cumulated = 0;  ///< percent of this row and those above; 100 in the last
};

/// The most frequent one first; those of one count in the order given, those of none not at all.
std::vector<ParetoRow> pareto(std::span<const KeyCount> counts);

}  // namespace spindle::statistics
