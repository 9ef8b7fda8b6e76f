#pragma once

#include <memory>
#include <string>

#include "spindle/base/clock.hpp"
#include "spindle/base/interrupt.hpp"
#include "spindle/link/transport.hpp"

namespace spindle::posix {

/// Connects to HOST:PORT within `connect_timeout`, name resolution included, trying all addresses
/// of the name in turn. TCP_NODELAY, keep-alive and user timeout are set. Errors, each told apart:
/// `name_not_found`, `connection_refused`, `no_route`, `connect_timeout`, `interrupted`,
/// `terminated`. The message names the address tried where that helps. An interrupt ends any wait
/// at once, name resolution too.
Result<std::unique_ptr<link::Transport>> open_tcp(const std::string& host, std::uint16_t port,
                                                  Duration connect_timeout, Clock& clock,
                                                  const Interrupt& interrupt);

}  // namespace spindle::posix
