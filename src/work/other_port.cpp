#include "spindle/work/other_port.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cstddef>
#include <vector>

#include "spindle/work/tool_memory.hpp"

namespace spindle::work {
namespace {

constexpr std::size_t most_places = 3;  // the ones that were seen last

}  // namespace

std::string other_port_hint(const Target& target, const Environment& environment) {
  const auto seen =
      ToolMemory(environment.disk, environment.cache_folder).seen_behind(target.endpoint);
  if (seen && !seen->empty()) {
    std::vector<std::string> places;
    for (auto tool = seen->rbegin(); tool != seen->rend() && places.size() < most_places; ++tool) {
      places.push_back(
          fmt::format("serial number {} was seen at port {}", tool->serial, tool->port));
    }
    return fmt::format(
        "no port is named, and {}: add {}", fmt::join(places, ", "),
        has_one_port(*seen) ? fmt::format(":{}", seen->back().port) : "the port that is meant");
  }
  for (const files::ProfileEntry& entry : environment.profiles.list()) {
    const auto profile = environment.profiles.load(entry.id);
    if (!profile || profile->link.port == catalogue::LinkSpec().port) continue;
    return fmt::format("no port is named, and {} tools listen on port {}: add :{} or --profile {}",
                       profile->series, profile->link.port, profile->link.port, profile->id);
  }
  return {};
}

}  // namespace spindle::work
