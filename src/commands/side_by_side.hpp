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

/// What several tools share when they hang on one serial line; the target itself for all others.
inline std::string line_of(const Target& target) {
  if (target.endpoint.medium == link::Medium::serial) return target.endpoint.device;
  if (target.endpoint.medium == link::Medium::rtu_over_tcp) {
    return target.endpoint.host + ":" + std::to_string(target.endpoint.port.value_or(0));
  }
  return {};
}

/// Calls `handle(target)` for every target, side by side when there are several, and returns the
/// results in the order of the targets. Tools on one serial line take turns: only one request at a
/// time fits there. Threads share nothing that changes.
template <typename Handle>
auto side_by_side(const std::vector<Target>& targets, Handle handle) {
  using Handled = std::invoke_result_t<Handle, const Target&>;
  std::vector<std::optional<Handled>> slots(targets.size());
  std::map<std::string, std::vector<std::size_t>> lines;
  std::vector<std::vector<std::size_t>> turns;
  for (std::size_t index = 0; index < targets.size(); ++index) {
    const std::string line = line_of(targets[index]);
    if (line.empty()) {
      turns.push_back({index});
    } else {
      lines[line].push_back(index);
    }
  }
  for (auto& [line, indices] : lines) turns.push_back(std::move(indices));
  const auto fill = [&](const std::vector<std::size_t>& indices) {
    for (const std::size_t index : indices) slots[index] = handle(targets[index]);
  };
  if (turns.size() == 1) {
    fill(turns.front());
  } else {
    std::vector<std::jthread> threads;
    threads.reserve(turns.size());
    for (const auto& indices : turns) threads.emplace_back([&fill, &indices] { fill(indices); });
  }
  std::vector<Handled> results;
  results.reserve(slots.size());
  for (auto& slot : slots) results.push_back(std::move(*slot));
  return results;
}

}  // namespace spindle::commands
