#include "watched_tool.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "shared_lines.hpp"

namespace spindle::commands {

Result<const KnownProfile*> ProfileShelf::take(const std::string& id) {
  const std::lock_guard lock(mutex_);
  const auto known = profiles_.find(id);
  if (known != profiles_.end()) return known->second.get();
  auto profile = store_->load(id);
  if (!profile) return tl::unexpected(std::move(profile.error()));
  auto tables = store_->load_code_tables(id);
  if (!tables) return tl::unexpected(std::move(tables.error()));
  auto& place = profiles_[id];
  place =
      std::make_unique<const KnownProfile>(KnownProfile{std::move(*profile), std::move(*tables)});
  return place.get();
}

Result<WatchedTool> WatchedTool::make(Target target, ProfileShelf& shelf, const Context& context) {
  WatchedTool tool(std::move(target), shelf, context);
  if (tool.target_.profile.empty()) return tool;
  return tool.learn(tool.target_.profile).map([&] { return std::move(tool); });
}

Result<void> WatchedTool::learn(const std::string& profile) {
  return shelf_->take(profile).map([&](const KnownProfile* known) { known_ = known; });
}

Result<void> WatchedTool::find_profile(const Context& context) {
  auto tool = open_tool(target_, catalogue::Profile(), Need::named_registers, context);
  if (!tool) return tl::unexpected(std::move(tool.error()));
  target_ = tool->target;
  target_.profile = tool->profile->id;
  return learn(target_.profile);
}

Result<device::Watcher::Link> WatchedTool::open(Duration patience,
                                                const device::OpenTransport& open_transport) {
  Context hurried = with_lines(*context_, open_transport);
  const catalogue::LinkFacts facts =
      known_ == nullptr ? catalogue::LinkFacts() : known_->profile.link;
  const Duration usual = hurried.common.connect_timeout.value_or(facts.connect);
  hurried.common.connect_timeout = std::min(usual, patience);
  if (known_ == nullptr) {
    if (auto found = find_profile(hurried); !found) return tl::unexpected(std::move(found.error()));
  }
  auto device =
      connect_device(target_, known_->profile, hurried, SimulatedOperator::working, past_);
  if (!device) return tl::unexpected(std::move(device.error()));
  if (auto registers = device->require_known_registers(); !registers) {
    return tl::unexpected(std::move(registers.error()));
  }
  past_ = link::SessionOptions::Past::doubtful;  // it is opened again after trouble only
  if (known_->profile.link.loopback) {
    if (auto there = device->require_answer(); !there) {
      return tl::unexpected(std::move(there.error()));
    }
  }
  std::string identity = device->identity_text();
  return device::Watcher::Link{std::move(*device), std::move(identity)};
}

Result<std::vector<WatchedTool>> prepare_tools(const std::vector<std::string>& targets,
                                               ProfileShelf& shelf, const Context& context) {
  auto resolved = resolve_targets(targets, context);
  if (!resolved) return tl::unexpected(std::move(resolved.error()));
  std::vector<WatchedTool> tools;
  std::vector<catalogue::LinkFacts> facts;
  tools.reserve(resolved->size());
  for (const Target& target : *resolved) {
    auto tool = WatchedTool::make(target, shelf, context);
    if (!tool) return tl::unexpected(std::move(tool.error()));
    const KnownProfile* known = tool->known();
    facts.push_back(known == nullptr ? catalogue::LinkFacts() : known->profile.link);
    tools.push_back(std::move(*tool));
  }
  return check_same_settings(*resolved, facts).map([&] { return std::move(tools); });
}

}  // namespace spindle::commands
