#include "odometer.hpp"

#include <algorithm>
#include <map>
#include <string_view>
#include <utility>

#include "spindle/report/record.hpp"

namespace spindle::commands {
namespace {

using store::EventView;
using store::RowId;

/// Where an event stands among all of its tool.
using Position = std::pair<std::int64_t, std::int64_t>;  ///< epoch and number
constexpr Position before_all = {-1, -1};

/// What a tool said when it was connected.
struct Total {
  WallTime at = {};
  std::int64_t total = 0;
  Position last = before_all;  ///< the last event that was known then
  std::int64_t stored = 0;     ///< fastenings behind it, up to the next total
  bool has_caught_up = false;  ///< an event behind it was looked at
};

std::optional<std::int64_t> number_of(const report::Record& record, std::string_view key) {
  const report::Field* field = record.find(key);
  const auto* number = field == nullptr ? nullptr : std::get_if<Decimal>(&field->cell);
  return number == nullptr ? std::nullopt : std::optional(number->mantissa());
}

std::optional<Total> total_of(const store::Happening& row) {
  const auto record = report::record_of(row.json, row.at);
  const auto total = record ? number_of(*record, "total") : std::nullopt;
  if (!total) return std::nullopt;
  const auto epoch = number_of(*record, "epoch");
  const auto number = number_of(*record, "number");
  return Total{.at = row.at,
               .total = *total,
               .last = epoch && number ? Position(*epoch, *number) : before_all};
}

bool is_fastening(const EventView& row) {
  return row.kind == "fastening-ok" || row.kind == "fastening-ng";
}

/// The event that a tool held when it was connected had happened before, so its total has it.
void count(std::vector<Total>& totals, const EventView& row) {
  const Position position = {row.epoch, row.number};
  const auto behind = std::partition_point(
      totals.begin(), totals.end(), [&](const Total& total) { return total.last < position; });
  if (behind == totals.begin()) return;
  auto total = std::prev(behind);
  const bool is_older = !total->has_caught_up && row.source == "catch-up";
  total->has_caught_up = true;
  if (is_older && total == totals.begin()) return;
  if (is_older) --total;
  if (is_fastening(row)) ++total->stored;
}

std::vector<Mileage> mileage_of(RowId tool, const std::vector<Total>& totals) {
  std::vector<Mileage> all;
  for (std::size_t index = 1; index < totals.size(); ++index) {
    const Mileage next{.tool = tool,
                       .since = totals[index - 1].at,
                       .until = totals[index].at,
                       .counted = totals[index].total - totals[index - 1].total,
                       .stored = totals[index - 1].stored};
    if (!all.empty() && all.back().missing() == 0 && next.missing() == 0) {
      all.back().until = next.until;
      all.back().counted += next.counted;
      all.back().stored += next.stored;
    } else {
      all.push_back(next);
    }
  }
  return all;
}

}  // namespace

Result<std::vector<Mileage>> read_mileage(store::Reader& reader) {
  std::map<RowId, std::vector<Total>> totals;
  auto read = reader.happenings({.kinds = {"total"}}, [&](const store::Happening& row) {
    const auto total = total_of(row);
    if (row.tool && total) totals[*row.tool].push_back(*total);
    return true;
  });
  if (!read) return tl::unexpected(std::move(read.error()));
  if (totals.empty()) return std::vector<Mileage>();
  read = reader.events({}, [&](const EventView& row) {
    const auto of_tool = totals.find(row.tool);
    if (of_tool != totals.end()) count(of_tool->second, row);
    return true;
  });
  if (!read) return tl::unexpected(std::move(read.error()));
  std::vector<Mileage> all;
  for (const auto& [tool, of_tool] : totals) {
    for (const Mileage& mileage : mileage_of(tool, of_tool)) all.push_back(mileage);
  }
  return all;
}

}  // namespace spindle::commands
