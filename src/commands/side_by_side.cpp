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

}  // namespace spindle::commands
