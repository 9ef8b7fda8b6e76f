#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "spindle/commands/commands.hpp"
#include "spindle/device/watcher.hpp"
#include "spindle/report/renderer.hpp"
#include "watched_tool.hpp"

namespace spindle::commands {

/// What listens to one tool that is watched.
class Listener {
 public:
  Listener() = default;
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;
  virtual ~Listener() = default;

  /// When to end, as far as is known now.
  virtual TimePoint until() = 0;
  /// The tool was opened, and what it is is known now.
  virtual void opened(const WatchedTool& tool) = 0;
  virtual device::WatchControl tell(const device::WatchEvent& news) = 0;
  /// How the watch ended. `unreached` says why there never was a link to it.
  virtual void left(const Result<void>& watched, const std::optional<Error>& unreached) = 0;

  /// What a record of the tool's events knows and wants.
  virtual device::RecordHooks hooks() { return {}; }
};

/// The columns of a stream of what these tools tell. Motors have other ones than tools that count
/// their results.
std::vector<report::Column> columns_for(const std::vector<WatchedTool>& tools, ProfileShelf& shelf,
                                        const WatchOptions& options, const Context& context);

/// Watches one tool until its listener wants to end.
void watch_tool(WatchedTool& tool, const device::OpenTransport& open_transport,
                const device::Watcher::Plan& plan, device::Reconnection reconnection,
                Listener& listener, const Context& context);

}  // namespace spindle::commands
