#include "watched_tool.hpp"

#include <utility>

#include "open_sim.hpp"

namespace spindle::commands {
namespace {

/// Loads what belongs to a profile, unless it was loaded for another tool.
Result<void> load_shared(WatchedTools& shared, const std::string& name, const Context& context) {
  if (shared.profiles.contains(name)) return {};
  auto profile = context.profiles.load(name);
  if (!profile) return tl::unexpected(std::move(profile.error()));
  auto errors = context.profiles.load_error_codes(name);
  if (!errors) return tl::unexpected(std::move(errors.error()));
  shared.profiles[name] = std::make_unique<const catalogue::Profile>(std::move(*profile));
  shared.errors[name] = std::make_unique<const catalogue::CodeTexts>(std::move(*errors));
  return {};
}

}  // namespace

Result<WatchedTools> prepare_tools(const std::vector<std::string>& targets,
                                   const Context& context) {
  auto resolved = resolve_targets(targets, context);
  if (!resolved) return tl::unexpected(std::move(resolved.error()));
  WatchedTools shared;
  for (Target& target : *resolved) {
    if (target.profile.empty()) {
      auto tool = open_tool(target, catalogue::Profile(), Need::named_registers, context);
      if (!tool) return tl::unexpected(std::move(tool.error()));
      target = tool->target;
      target.profile = tool->profile->id;
    }
    if (auto loaded = load_shared(shared, target.profile, context); !loaded) {
      return tl::unexpected(std::move(loaded.error()));
    }
    const std::string name = target.profile;
    shared.tools.push_back(
        {std::move(target), shared.profiles[name].get(), shared.errors[name].get()});
  }
  return shared;
}

device::Watcher::Open link_opener(const WatchedTool& tool, const Context& context) {
  return [&tool, &context]() -> Result<device::Watcher::Link> {
    auto device = connect_device(tool.target, *tool.profile, context);
    if (!device) return tl::unexpected(std::move(device.error()));
    if (auto known = device->require_known_registers(); !known) {
      return tl::unexpected(std::move(known.error()));
    }
    std::string identity = device->identity_text();
    return device::Watcher::Link{std::move(*device), std::move(identity)};
  };
}

}  // namespace spindle::commands
