#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "spindle/store/reader.hpp"

namespace spindle::commands {

/// What a tool itself counted between two times at which it said its total of fastenings, against
/// what is stored of that time.
struct Mileage {
  store::RowId tool = 0;
  WallTime since = {};
  WallTime until = {};
  std::int64_t counted = 0;  ///< by the tool
  std::int64_t stored = 0;

  /// Empty: the tool's total was set back, or counts something else.
  [[nodiscard]] std::optional<std::int64_t> missing() const {
    return counted < stored ? std::nullopt : std::optional(counted - stored);
  }
};

/// Of every tool, in order. Times of which nothing is missing are one, one behind the other. A tool
/// that said less than two totals has none.
Result<std::vector<Mileage>> read_mileage(store::Reader& reader);

}  // namespace spindle::commands
