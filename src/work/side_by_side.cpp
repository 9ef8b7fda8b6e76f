#include "spindle/work/side_by_side.hpp"

#include <map>

namespace spindle::work {

std::vector<std::vector<std::size_t>> by_line(const std::vector<std::string>& lines) {
  std::vector<std::vector<std::size_t>> places;
  std::map<std::string, std::size_t> known;
  for (std::size_t index = 0; index < lines.size(); ++index) {
    const auto [line, is_new] = known.try_emplace(lines[index], places.size());
    if (lines[index].empty() || is_new) {
      places.push_back({index});
    } else {
      places[line->second].push_back(index);
    }
  }
  return places;
}

FinishedCounter::FinishedCounter(Finished finished, OnFinished tell)
    : finished_(finished), tell_(std::move(tell)) {
  if (tell_) tell_(finished_);
}

void FinishedCounter::add() {
  const std::lock_guard lock(mutex_);
  ++finished_.done;
  if (tell_) tell_(finished_);
}

}  // namespace spindle::work
