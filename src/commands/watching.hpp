#pragma once

#include <functional>
#include <optional>

#include "spindle/device/watcher.hpp"
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

/// Watches one tool until its listener wants to end.
void watch_tool(WatchedTool& tool, const device::OpenTransport& open_transport,
                const device::Watcher::Plan& plan, device::Reconnection reconnection,
                Listener& listener, const Context& context);

}  // namespace spindle::commands
