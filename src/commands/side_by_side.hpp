#pragma once

#include <map>
#include <optional>
#include <string>
#include <thread>
#include <type_traits>
#include <utility>
#include <vector>

#include "spindle/commands/target.hpp"

namespace spindle::commands {

/// Places of the targets that share a line, line by line.
std::vector<std::vector<std::size_t>> by_line(const std::vector<Target>& targets);

/// Calls `handle(target)` for every target, in a thread of its own for every line when there are
/// several, and returns the results in the order of the targets. The units of one serial line take
/// turns: only one at a time can have it. Threads share nothing that changes.
template <typename Handle>
auto side_by_side(const std::vector<Target>& targets, Handle handle) {
  using Handled = std::invoke_result_t<Handle, const Target&>;
  std::vector<std::optional<Handled>> slots(targets.size());
  const auto fill = [&](const std::vector<std::size_t>& line) {
    for (const std::size_t index : line) slots[index] = handle(targets[index]);
  };
  const auto lines = by_line(targets);
  if (lines.size() == 1) {
    fill(lines.front());
  } else {
    std::vector<std::jthread> threads;
    threads.reserve(lines.size());
    for (const auto& line : lines) threads.emplace_back(fill, line);
  }
  std::vector<Handled> results;
  results.reserve(slots.size());
  for (auto& slot : slots) results.push_back(std::move(*slot));
  return results;
}

}  // namespace spindle::commands
