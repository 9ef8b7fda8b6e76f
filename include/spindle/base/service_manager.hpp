#pragma once

#include <functional>
#include <optional>
#include <string_view>

#include "spindle/base/clock.hpp"

namespace spindle {

/// What the service manager that started this process wants of it (sd_notify(3),
/// sd_watchdog_enabled(3)).
struct ServiceManager {
  /// Sends a state, such as "READY=1". Empty: none listens. May be called from any thread; what is
  /// not taken within seconds is lost.
  std::function<void(std::string_view state)> notify = {};
  /// How long it waits for "WATCHDOG=1" at most; empty: for ever.
  std::optional<Duration> watchdog = std::nullopt;
};

}  // namespace spindle
