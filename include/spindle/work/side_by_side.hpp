#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <type_traits>
#include <utility>
#include <vector>

#include "spindle/work/target.hpp"

namespace spindle::work {

inline const Target& target_of(const Target& target) { return target; }

/// Places of the items whose lines have the same name, line by line; one without a name is a line
/// of its own.
std::vector<std::vector<std::size_t>> by_line(const std::vector<std::string>& lines);

/// Places of what is done on tools that share a line, line by line.
template <typename Item>
std::vector<std::vector<std::size_t>> by_line(const std::vector<Item>& items) {
  std::vector<std::string> lines;
  for (const Item& item : items) lines.push_back(shared_connection(target_of(item).endpoint));
  return by_line(lines);
}

/// How many of several tools have come to an end.
struct Finished {
  std::size_t done = 0;
  std::size_t total = 0;
  std::size_t at_once = 1;  ///< how many are under way side by side
};
using OnFinished = std::function<void(const Finished&)>;

/// Counts what comes to an end, and tells it at once, by one thread at a time.
class FinishedCounter {
 public:
  FinishedCounter(Finished finished, OnFinished tell);
  void add();

 private:
  std::mutex mutex_ = {};
  Finished finished_;
  OnFinished tell_;
};

/// Calls `handle(item)` for every item, at most `jobs` (from 1) at a time, each in a thread of its
/// own when there are several, and returns the results in the order of the items. `target_of(item)`
/// is the tool that it is about: the units of one serial line or gateway take turns, as only one at
/// a time can have it. Threads share nothing that changes but the place of the next line, and
/// `tell`.
template <typename Item, typename Handle>
auto side_by_side(const std::vector<Item>& items, std::size_t jobs, Handle handle,
                  OnFinished tell = {}) {
  using Handled = std::invoke_result_t<Handle, const Item&>;
  std::vector<std::optional<Handled>> slots(items.size());
  const auto lines = by_line(items);
  const std::size_t threads_wanted = std::max<std::size_t>(std::min(jobs, lines.size()), 1);
  FinishedCounter finished({.total = items.size(), .at_once = threads_wanted}, std::move(tell));
  const auto fill = [&](const std::vector<std::size_t>& line) {
    for (const std::size_t index : line) {
      slots[index] = handle(items[index]);
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

}  // namespace spindle::work
