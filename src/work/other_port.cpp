#include "spindle/work/other_port.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cstddef>
#include <string>
#include <vector>

#include "spindle/work/tool_memory.hpp"

namespace spindle::work {
namespace {

constexpr std::size_t most_places = 3;  // the ones that were seen last

/// What was typed, with this port. The name of a tool has none.
Remedy with_port(const Target& target, std::uint16_t port) {
  const bool is_address =
      link::looks_like_url(target.shown) && target.shown.find('?') == std::string::npos;
  if (!is_address) return {};
  return {.wrong = target.shown, .right = fmt::format("{}:{}", target.shown, port)};
}

}  // namespace

void suggest_port(const Target& target, const Environment& environment, Error& error) {
  const auto seen =
      ToolMemory(environment.disk, environment.cache_folder).seen_behind(target.endpoint);
  if (seen && !seen->empty()) {
    std::vector<std::string> places;
    for (auto tool = seen->rbegin(); tool != seen->rend() && places.size() < most_places; ++tool) {
      places.push_back(
          fmt::format("serial number {} was seen at port {}", tool->serial, tool->port));
    }
    const bool is_one = has_one_port(*seen);
    error.hint =
        fmt::format("no port is named, and {}: add {}", fmt::join(places, ", "),
                    is_one ? fmt::format(":{}", seen->back().port) : "the port that is meant");
    if (is_one) error.remedy = with_port(target, seen->back().port);
    return;
  }
  for (const files::ProfileEntry& entry : environment.profiles.list()) {
    const auto profile = environment.profiles.load(entry.id);
    if (!profile || profile->link.port == catalogue::LinkSpec().port) continue;
    error.hint =
        fmt::format("no port is named, and {} tools listen on port {}: add :{} or --profile {}",
                    profile->series, profile->link.port, profile->link.port, profile->id);
    error.remedy = with_port(target, profile->link.port);
    return;
  }
}

}  // namespace spindle::work
