#include "spindle/work/shared_lines.hpp"

#include <fmt/format.h>

#include <utility>

#include "spindle/link/reopening_transport.hpp"
#include "spindle/work/connect.hpp"
#include "spindle/work/side_by_side.hpp"
#include "spindle/work/trace.hpp"

namespace spindle::work {

SharedLines::SharedLines(const std::vector<Target>& targets, const Environment& environment, Of of)
    : environment_(&environment), of_(of) {
  const auto stays = [&](const link::Endpoint& endpoint) {
    if (endpoint.gateway.empty()) return link::Stays::while_shared;
    return of == Of::gateways ? link::Stays::while_it_lives : link::Stays::while_answering;
  };
  for (const auto& line : by_line(targets)) {
    const link::Endpoint& first = targets[line.front()].endpoint;
    if (line.size() == 1 || (of == Of::gateways && first.gateway.empty())) continue;
    lines_.emplace(shared_connection(first),
                   std::make_unique<link::SharedLine>(environment.clock, stays(first)));
  }
}

/// One unit after the other cannot know that the gateway has hung up behind the one before.
link::SharedLine::Open SharedLines::reopening(const link::Endpoint& endpoint,
                                              const link::SharedLine::Open& open) const {
  return [this, open, gateway = endpoint.gateway]() -> Result<std::unique_ptr<link::Transport>> {
    auto opened = open();
    if (!opened) return opened;
    return std::make_unique<link::ReopeningTransport>(
        std::move(*opened), open, environment_->clock,
        make_trace(gateway, modbus::Framing::tcp, *environment_));
  };
}

device::OpenTransport SharedLines::opener() {
  return [this](const link::Endpoint& endpoint, const catalogue::LinkSpec& facts,
                Duration connect_timeout) {
    const link::SharedLine::Open open = [open = &environment_->open, endpoint, facts,
                                         connect_timeout] {
      return (*open)(endpoint, facts, connect_timeout);
    };
    const auto line = lines_.find(shared_connection(endpoint));
    if (line == lines_.end()) return open();
    return line->second->join(of_ == Of::gateways ? reopening(endpoint, open) : open);
  };
}

Result<void> check_same_settings(const std::vector<Target>& targets,
                                 const std::vector<catalogue::LinkSpec>& facts) {
  const auto settings = [&](std::size_t index) {
    const link::Endpoint& endpoint = targets[index].endpoint;
    return std::pair(link::serial_settings(endpoint, facts[index].serial.line), endpoint.switching);
  };
  for (const auto& line : by_line(targets)) {
    if (!targets[line.front()].endpoint.gateway.empty()) continue;  // it sets its line itself
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
