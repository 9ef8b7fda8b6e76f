#include "spindle/work/shared_lines.hpp"

#include <fmt/format.h>

#include <utility>

#include "spindle/work/connect.hpp"
#include "spindle/work/side_by_side.hpp"

namespace spindle::work {

SharedLines::SharedLines(const std::vector<Target>& targets, const Environment& environment)
    : open_(&environment.open) {
  for (const auto& line : by_line(targets)) {
    if (line.size() == 1) continue;
    lines_.emplace(shared_line(targets[line.front()].endpoint),
                   std::make_unique<link::SharedLine>(environment.clock));
  }
}

device::OpenTransport SharedLines::opener() {
  return [this](const link::Endpoint& endpoint, const catalogue::LinkSpec& facts,
                Duration connect_timeout) {
    const auto open = [&] { return (*open_)(endpoint, facts, connect_timeout); };
    const auto line = lines_.find(shared_line(endpoint));
    return line == lines_.end() ? open() : line->second->join(open);
  };
}

Result<void> check_same_settings(const std::vector<Target>& targets,
                                 const std::vector<catalogue::LinkSpec>& facts) {
  const auto settings = [&](std::size_t index) {
    const link::Endpoint& endpoint = targets[index].endpoint;
    return std::pair(link::serial_settings(endpoint, facts[index].serial.line), endpoint.switching);
  };
  for (const auto& line : by_line(targets)) {
    for (const std::size_t index : line) {
      if (settings(index) == settings(line.front())) continue;
      return tl::unexpected(
          Error{.code = Errc::usage,
                .message = fmt::format("{} and {} are on one serial line, but their rate, parity, "
                                       "stop bits or rs485 differ",
                                       targets[line.front()].shown, targets[index].shown),
                .hint = "a line has one setting: mend what stands behind '?' in their URLs"});
    }
  }
  return {};
}

Result<std::vector<Target>> resolve_compatible_targets(const std::vector<std::string>& texts,
                                                       const Environment& environment) {
  auto targets = resolve_targets(texts, environment);
  if (!targets) return targets;
  const auto lines = by_line(*targets);
  if (lines.size() == targets->size()) return targets;  // each has a line of its own
  std::map<std::string, catalogue::LinkSpec> known;     // each profile is read once
  std::vector<catalogue::LinkSpec> facts;
  for (const Target& target : *targets) {
    const auto [entry, is_new] = known.try_emplace(target.profile);
    if (is_new) {
      const auto profile = load_profile(target, environment);
      if (profile) entry->second = profile->link;  // else told when it is used
    }
    facts.push_back(entry->second);
  }
  return check_same_settings(*targets, facts).map([&] { return std::move(*targets); });
}

}  // namespace spindle::work
