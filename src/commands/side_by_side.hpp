#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <type_traits>
#include <utility>
#include <vector>

#include "progress.hpp"
#include "spindle/commands/target.hpp"

namespace spindle::commands {

/// Places of the targets that share a line, line by line.
std::vector<std::vector<std::size_t>> by_line(const std::vector<Target>& targets);

/// Shows how many of several tools have come to an end, where anybody wants to see it.
class FinishedTools {
 public:
  FinishedTools(ProgressLine* progress, std::size_t tools, std::size_t at_once);
  void add();

 private:
  void show();

  ProgressLine* progress_;
  std::mutex mutex_ = {};
  report::Step step_;
};

/// Calls `handle(target)` for every target, at most `jobs` (from 1) at a time, each in a thread of
/// its own when there are several, and returns the results in the order of the targets. The units
/// of one serial line take turns: only one at a time can have it. Threads share nothing that
/// changes but the place of the next line, and `progress`.
template <typename Handle>
auto side_by_side(const std::vector<Target>& targets, std::size_t jobs, Handle handle,
                  ProgressLine* progress = nullptr) {
  using Handled = std::invoke_result_t<Handle, const Target&>;
  std::vector<std::optional<Handled>> slots(targets.size());
  const auto lines = by_line(targets);
  const std::size_t threads_wanted = std::max<std::size_t>(std::min(jobs, lines.size()), 1);
  FinishedTools finished(progress, targets.size(), threads_wanted);
  const auto fill = [&](const std::vector<std::size_t>& line) {
    for (const std::size_t index : line) {
      slots[index] = handle(targets[index]);
      finished.add();
    }
  };
  std::atomic<std::size_t> next = 0;
  const auto work = [&] {
    for (std::size_t line = next++; line < lines.size(); line = next++) fill(lines[line]);
  };
  {
    std::vector<std::jthread> threads;
    threads.reserve(threads_wanted - 1);
    for (std::size_t other = 1; other < threads_wanted; ++other) threads.emplace_back(work);
    work();
  }
  std::vector<Handled> results;
  results.reserve(slots.size());
  for (auto& slot : slots) results.push_back(std::move(*slot));
  return results;
}

}  // namespace spindle::commands
