#pragma once

#include <cstdint>
#include <string>

#include "posix/descriptor.hpp"
#include "spindle/base/clock.hpp"
#include "spindle/base/interrupt.hpp"

namespace spindle::posix {

/// A non-blocking socket that listens, and the port that it got.
struct Listener {
  Descriptor socket;
  std::uint16_t port = 0;
};

/// Listens on the first address of `host` that can be bound. Errors: `port_busy`, `port_unusable`
/// (also for a name without an address), `interrupted`, `terminated`.
Result<Listener> listen_on(const std::string& host, std::uint16_t port, const Clock& clock,
                           const Interrupt& interrupt);

}  // namespace spindle::posix
