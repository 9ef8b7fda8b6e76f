#pragma once

#include <sys/socket.h>

#include <cstdint>
#include <string>
#include <vector>

#include "spindle/base/clock.hpp"
#include "spindle/base/interrupt.hpp"

namespace spindle::posix {

/// The address of one TCP port, IPv4 or IPv6.
struct Address {
  sockaddr_storage storage = {};
  socklen_t size = 0;

  [[nodiscard]] const sockaddr* data() const { return reinterpret_cast<const sockaddr*>(&storage); }
};

/// "192.168.10.23" or "fe80::1%eth0", without the port.
std::string to_text(const Address& address);

/// The port in host byte order.
std::uint16_t port_of(const Address& address);

struct Resolved {
  enum class Given : std::uint8_t { address, name } given;
  std::vector<Address> addresses;  ///< at least one, in the system's order of preference
};

/// The addresses of a numeric address (never waits) or of a name. Errors: `name_not_found`, also
/// when the name server does not answer before the deadline; `interrupted`, `terminated`.
Result<Resolved> resolve(const std::string& host, std::uint16_t port, TimePoint deadline,
                         const Clock& clock, const Interrupt& interrupt);

}  // namespace spindle::posix
