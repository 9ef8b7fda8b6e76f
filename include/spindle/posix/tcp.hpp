#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "spindle/base/clock.hpp"
#include "spindle/base/interrupt.hpp"
#include "spindle/link/transport.hpp"

namespace spindle::posix {

/// What is behind a TCP port.
enum class Behind : std::uint8_t {
  tool,       ///< which serves each connection by itself
  line,       ///< a serial line, which is locked among the programs of one user
  busy_line,  ///< the same, but used also where another program has the lock: to stop a motor
};

/// Asks the program that has the line of this name (Transport::line_name()); empty where there is
/// none, so that the line is to be opened.
using AskOwner =
    std::function<std::optional<Result<std::unique_ptr<link::Transport>>>(const std::string& name)>;

/// Connects to HOST:PORT within `connect_timeout`, name resolution included, trying all addresses
/// of the name in turn. TCP_NODELAY, keep-alive and user timeout are set. Errors, each told apart:
/// `name_not_found`, `connection_refused`, `no_route`, `connect_timeout`, `interrupted`,
/// `terminated`; `port_busy` where another spindle uses the line. The message names the address
/// tried where that helps. An interrupt ends any wait at once, name resolution too.
/// Where `ask` finds another program that has a connection to one of the addresses, it is asked
/// instead.
Result<std::unique_ptr<link::Transport>> open_tcp(const std::string& host, std::uint16_t port,
                                                  Duration connect_timeout, Clock& clock,
                                                  const Interrupt& interrupt,
                                                  Behind behind = Behind::tool,
                                                  const AskOwner& ask = {});

}  // namespace spindle::posix
