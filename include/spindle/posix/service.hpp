#pragma once

#include "spindle/base/service_manager.hpp"
#include "spindle/posix/signals.hpp"

namespace spindle::posix {

/// Reads NOTIFY_SOCKET, WATCHDOG_USEC and WATCHDOG_PID, and takes them out of the environment, as
/// no child of ours is the service. A program that only hands itself over to another one (exec)
/// leaves them to that. To be called before there are threads.
ServiceManager take_service_manager();

/// That, and the wish to reload, as the aggregate that its user has for them. `signals` must
/// outlive it.
template <typename Supervision>
Supervision supervision(SignalWatch& signals) {
  return {.heed_reload = [&signals] { signals.heed_reload(); },
          .take_reload = [&signals] { return signals.take_reload(); },
          .take_manager = take_service_manager};
}

}  // namespace spindle::posix
