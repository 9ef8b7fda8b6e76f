#include "store/coverage.hpp"

#include <algorithm>
#include <map>
#include <utility>

namespace spindle::store {
namespace {

constexpr std::int64_t highest_number = 65'535;

/// Numbers from the first to the last.
struct Range {
  std::int64_t first = 0;
  std::int64_t last = 0;
};

struct EpochRanges {
  EpochReason reason = EpochReason::first;
  std::size_t rows = 0;
  std::vector<Range> of_rows = {};  ///< in order, none beside another one
  std::vector<Range> of_gaps = {};
  std::size_t unknown_gaps = 0;
  bool runs_to_wrap = false;  ///< the next epoch began behind the highest number
  bool begins_at_wrap = false;
};

using EpochName = std::pair<RowId, std::int64_t>;  ///< tool and ordinal
using Epochs = std::map<EpochName, EpochRanges>;

/// An epoch that was trimmed away has no rows, and says nothing of the numbers of its neighbour.
bool has_rows(const Epochs& epochs, const EpochName& name) {
  const auto found = epochs.find(name);
  return found != epochs.end() && found->second.rows != 0;
}

void read_epochs(Connection& connection, Epochs& epochs) {
  Statement statement(connection, "SELECT tool, ordinal, reason FROM epoch");
  Rows rows = statement.query();
  while (rows.next()) {
    epochs[{rows.integer(0), rows.integer(1)}].reason =
        epoch_reason_words.find(rows.text(2)).value_or(EpochReason::unsure);
  }
}

void read_rows(Connection& connection, Epochs& epochs) {
  Statement statement(connection,
                      "SELECT tool, epoch, number FROM event ORDER BY tool, epoch, number");
  Rows rows = statement.query();
  EpochName name = {};
  EpochRanges* epoch = nullptr;
  while (rows.next()) {
    const EpochName next = {rows.integer(0), rows.integer(1)};
    if (epoch == nullptr || next != name) epoch = &epochs[name = next];
    const std::int64_t number = rows.integer(2);
    ++epoch->rows;
    if (epoch->of_rows.empty() || epoch->of_rows.back().last + 1 != number) {
      epoch->of_rows.push_back({.first = number, .last = number});
    } else {
      epoch->of_rows.back().last = number;
    }
  }
}

void find_wraps(Epochs& epochs) {
  for (auto& [name, epoch] : epochs) {
    const EpochName previous = {name.first, name.second - 1};
    if (epoch.reason != EpochReason::wrap || epoch.rows == 0 || !has_rows(epochs, previous)) {
      continue;
    }
    epoch.begins_at_wrap = true;
    epochs[previous].runs_to_wrap = true;
  }
}

class GapRanges {
 public:
  explicit GapRanges(Epochs& epochs) : epochs_(epochs) {}

  void add(const EpochName& name, const Gap& gap) {
    EpochRanges& epoch = epochs_[name];
    if (!gap.missed || gap.at_least) ++epoch.unknown_gaps;
    const bool is_at_begin = name.second > 0 && gap.before &&
                             (epoch.of_rows.empty() || *gap.before <= epoch.of_rows.front().first);
    const bool falls = !gap.after || (gap.before && *gap.after >= *gap.before);
    if (is_at_begin && falls && epoch.reason == EpochReason::wrap) {
      add_wrap({name.first, name.second - 1}, name, gap);
    } else if (!gap.after || !gap.before || (is_at_begin && falls)) {
      add_counted(epoch, gap, is_at_begin);
    } else if (*gap.after < *gap.before) {
      cover(epoch, *gap.after + 1, *gap.before - 1);
    } else {
      add_wrap(name, {name.first, name.second + 1}, gap);
    }
  }

 private:
  static void cover(EpochRanges& epoch, std::int64_t first, std::int64_t last) {
    first = std::max<std::int64_t>(first, 0);
    last = std::min(last, highest_number);
    if (first <= last) epoch.of_gaps.push_back({.first = first, .last = last});
  }

  void add_wrap(const EpochName& before_wrap, const EpochName& behind_wrap, const Gap& gap) {
    const auto older = epochs_.find(before_wrap);
    if (gap.after && older != epochs_.end() && older->second.rows != 0) {
      cover(older->second, *gap.after + 1, highest_number);
    }
    const auto newer = epochs_.find(behind_wrap);
    if (newer != epochs_.end() && newer->second.reason == EpochReason::wrap) {
      cover(newer->second, 0, *gap.before - 1);
    }
  }

  /// One of whose ends only one is a number of this epoch.
  static void add_counted(EpochRanges& epoch, const Gap& gap, bool is_at_begin) {
    if (!gap.missed) return;
    const std::int64_t missed = *gap.missed;
    if (gap.before && (is_at_begin || !gap.after)) {
      cover(epoch, *gap.before - missed, *gap.before - 1);
    } else if (gap.after) {
      cover(epoch, *gap.after + 1, *gap.after + missed);
    }
  }

  Epochs& epochs_;
};

void read_gaps(Connection& connection, Epochs& epochs) {
  Statement statement(connection, "SELECT tool, epoch, after, before, missed, at_least FROM gap");
  Rows rows = statement.query();
  GapRanges ranges(epochs);
  while (rows.next()) {
    Gap gap;
    if (const auto after = rows.maybe(2)) gap.after = static_cast<std::uint16_t>(*after);
    if (const auto before = rows.maybe(3)) gap.before = static_cast<std::uint16_t>(*before);
    if (const auto missed = rows.maybe(4)) gap.missed = static_cast<std::uint32_t>(*missed);
    gap.at_least = rows.integer(5) != 0;
    ranges.add({rows.integer(0), rows.integer(1)}, gap);
  }
}

/// How many numbers are in any of the ranges.
std::size_t size_of(std::vector<Range> ranges) {
  std::ranges::sort(ranges, {}, &Range::first);
  std::int64_t count = 0;
  std::int64_t behind = 0;  ///< the first number that was not counted yet
  for (const Range& range : ranges) {
    const std::int64_t first = std::max(range.first, behind);
    if (range.last < first) continue;
    count += range.last - first + 1;
    behind = range.last + 1;
  }
  return static_cast<std::size_t>(count);
}

Coverage judged(const EpochName& name, const EpochRanges& epoch) {
  Coverage coverage = {.tool = name.first, .epoch = name.second};
  coverage.rows = epoch.rows;
  coverage.unknown_gaps = epoch.unknown_gaps;
  std::vector<Range> all = epoch.of_rows;
  all.insert(all.end(), epoch.of_gaps.begin(), epoch.of_gaps.end());
  if (all.empty()) return coverage;
  std::int64_t first = epoch.begins_at_wrap ? 0 : highest_number;
  std::int64_t last = epoch.runs_to_wrap ? highest_number : 0;
  for (const Range& range : all) {
    first = std::min(first, range.first);
    last = std::max(last, range.last);
  }
  coverage.first = static_cast<std::uint16_t>(first);
  coverage.last = static_cast<std::uint16_t>(last);
  const std::size_t covered = size_of(std::move(all));
  coverage.in_gaps = covered - epoch.rows;
  coverage.holes = static_cast<std::size_t>(last - first + 1) - covered;
  return coverage;
}

}  // namespace

std::vector<Coverage> coverage(Connection& connection) {
  Epochs epochs;
  read_epochs(connection, epochs);
  read_rows(connection, epochs);
  find_wraps(epochs);
  read_gaps(connection, epochs);
  std::vector<Coverage> all;
  for (const auto& [name, epoch] : epochs) {
    if (epoch.rows == 0 && epoch.of_gaps.empty() && epoch.unknown_gaps == 0) continue;
    all.push_back(judged(name, epoch));
  }
  return all;
}

}  // namespace spindle::store
