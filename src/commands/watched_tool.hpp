#pragma once

#include <map>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "spindle/commands/target.hpp"
#include "spindle/device/watcher.hpp"

namespace spindle::commands {

/// A tool that is opened again and again, with what is shared by all tools of its profile.
struct WatchedTool {
  Target target;
  const catalogue::Profile* profile;
  const catalogue::CodeTexts* errors;
};

/// Tools, and the profiles and texts that they refer to: each loaded once.
struct WatchedTools {
  std::vector<WatchedTool> tools;
  std::map<std::string, std::unique_ptr<const catalogue::Profile>> profiles;
  std::map<std::string, std::unique_ptr<const catalogue::CodeTexts>> errors;
};

/// Resolves targets; a profile that is not known is found by asking the tool once.
Result<WatchedTools> prepare_tools(const std::vector<std::string>& targets, const Context& context);

/// Opens one tool and makes sure that its registers are those of the profile.
device::Watcher::Open link_opener(const WatchedTool& tool, const Context& context);

/// Calls `handle` for every tool, each in a thread of its own when there are several, and returns
/// when all are done.
template <typename Handle>
void for_each_side_by_side(const std::vector<WatchedTool>& tools, Handle handle) {
  if (tools.size() == 1) return handle(tools.front());
  std::vector<std::jthread> threads;
  threads.reserve(tools.size());
  for (const WatchedTool& tool : tools) threads.emplace_back([&] { handle(tool); });
}

}  // namespace spindle::commands
