#pragma once

#include <optional>
#include <thread>
#include <type_traits>
#include <utility>
#include <vector>

#include "spindle/commands/target.hpp"

namespace spindle::commands {

/// Calls `handle(target)` for every target, each in a thread of its own when there are several, and
/// returns the results in the order of the targets. Threads share nothing that changes.
template <typename Handle>
auto side_by_side(const std::vector<Target>& targets, Handle handle) {
  using Handled = std::invoke_result_t<Handle, const Target&>;
  std::vector<std::optional<Handled>> slots(targets.size());
  const auto fill = [&](std::size_t index) { slots[index] = handle(targets[index]); };
  if (targets.size() == 1) {
    fill(0);
  } else {
    std::vector<std::jthread> threads;
    threads.reserve(targets.size());
    for (std::size_t index = 0; index < targets.size(); ++index) threads.emplace_back(fill, index);
  }
  std::vector<Handled> results;
  results.reserve(slots.size());
  for (auto& slot : slots) results.push_back(std::move(*slot));
  return results;
}

}  // namespace spindle::commands
