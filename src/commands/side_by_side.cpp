#include "side_by_side.hpp"

#include <map>
#include <string>

namespace spindle::commands {

std::vector<std::vector<std::size_t>> by_line(const std::vector<Target>& targets) {
  std::vector<std::vector<std::size_t>> lines;
  std::map<std::string, std::size_t> places;
  for (std::size_t index = 0; index < targets.size(); ++index) {
    const std::string line = shared_line(targets[index].endpoint);
    const auto [place, is_new] = places.try_emplace(line, lines.size());
    if (line.empty() || is_new) {
      lines.push_back({index});
    } else {
      lines[place->second].push_back(index);
    }
  }
  return lines;
}

FinishedTools::FinishedTools(ProgressLine* progress, std::size_t tools, std::size_t at_once)
    : progress_(tools > 1 ? progress : nullptr),
      step_({.what = "tools done:", .total = tools, .at_once = at_once}) {
  show();
}

void FinishedTools::add() {
  const std::lock_guard lock(mutex_);
  ++step_.done;
  show();
}

void FinishedTools::show() {
  if (progress_ != nullptr) progress_->advance(step_);
}

}  // namespace spindle::commands
