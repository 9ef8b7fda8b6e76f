#include "spindle/link/register_scan.hpp"

#include <algorithm>

namespace spindle::link {
namespace {

/// A range keeps its length in 16 bits, which 0..65535 does not fit.
constexpr std::uint32_t longest_range = 0x8000;

RegisterRange range_at(modbus::RegisterTable table, std::uint32_t first, std::uint32_t count) {
  return {table, static_cast<std::uint16_t>(first), static_cast<std::uint16_t>(count)};
}

/// The range without its first registers; the rest may be empty.
RegisterRange without_first(const RegisterRange& range, std::uint16_t count) {
  return range_at(range.table, std::uint32_t{range.first} + count, range.count - count);
}

}  // namespace

std::vector<RegisterRange> ranges_between(modbus::RegisterTable table, std::uint16_t from,
                                          std::uint16_t to,
                                          const std::set<std::uint16_t>& left_out) {
  std::vector<RegisterRange> ranges;
  std::uint32_t first = from;
  const auto add_until = [&](std::uint32_t end) {
    while (first < end) {
      const std::uint32_t count = std::min(end - first, longest_range);
      ranges.push_back(range_at(table, first, count));
      first += count;
    }
  };
  for (auto hole = left_out.lower_bound(from); hole != left_out.end() && *hole <= to; ++hole) {
    add_until(*hole);
    first = std::uint32_t{*hole} + 1;
  }
  add_until(std::uint32_t{to} + 1);
  return ranges;
}

RegisterScan::RegisterScan(const std::vector<RegisterRange>& wanted, BlockRules rules)
    : rules_(std::move(rules)), pending_(wanted.rbegin(), wanted.rend()) {
  rules_.longest = std::max<std::uint16_t>(rules_.longest, 1);
  rules_.most_bits = std::max<std::uint16_t>(rules_.most_bits, 1);
  for (const RegisterRange& range : wanted) wanted_ += range.count;
}

bool RegisterScan::is_forbidden(modbus::RegisterTable table, std::uint16_t count) const {
  const auto& shapes = rules_.forbidden_shapes;
  return count > 1 && std::any_of(shapes.begin(), shapes.end(), [&](const RegisterRange& shape) {
           return shape.table == table && shape.count == count;
         });
}

/// How many registers at the beginning of a range one request may have.
std::uint16_t RegisterScan::block_size(const RegisterRange& range) const {
  if (modbus::holds_bits(range.table)) return std::min(range.count, rules_.most_bits);
  std::uint16_t size = std::min(range.count, rules_.longest);
  const bool is_odd = range.first % 2 != 0;
  if (rules_.even_pairs && size > 1) size = static_cast<std::uint16_t>(is_odd ? 1 : size / 2 * 2);
  const std::uint16_t step = rules_.even_pairs && size > 2 ? 2 : 1;
  while (is_forbidden(range.table, size)) size = static_cast<std::uint16_t>(size - step);
  return size;
}

std::optional<RegisterRange> RegisterScan::next() const {
  if (pending_.empty()) return std::nullopt;
  RegisterRange block = pending_.back();
  block.count = block_size(block);
  return block;
}

void RegisterScan::push(const RegisterRange& range) {
  if (range.count > 0) pending_.push_back(range);
}

void RegisterScan::answer(RegisterView values) {
  const RegisterRange block = *next();
  const RegisterRange whole = pending_.back();
  pending_.pop_back();
  push(without_first(whole, block.count));
  known_ += block.count;
  answered_ += block.count;
  const bool goes_on = !runs_.empty() && runs_.back().table == block.table &&
                       std::uint32_t{runs_.back().last()} + 1 == block.first;
  if (!goes_on) runs_.push_back({.table = block.table, .first = block.first});
  Registers& run = runs_.back().values;
  run.insert(run.end(), values.begin(), values.end());
}

void RegisterScan::refuse() {
  const RegisterRange block = *next();
  const RegisterRange whole = pending_.back();
  pending_.pop_back();
  push(without_first(whole, block.count));
  const bool in_pairs = rules_.even_pairs && !modbus::holds_bits(block.table);
  const bool is_pair = in_pairs && block.count == 2;
  if (block.count == 1 || is_pair) {
    known_ += block.count;
    return;
  }
  auto half = static_cast<std::uint16_t>(block.count / 2);
  if (in_pairs && half % 2 != 0) ++half;
  push(without_first(block, half));
  push(range_at(block.table, block.first, half));
}

}  // namespace spindle::link
