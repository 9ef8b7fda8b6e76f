#pragma once

#include <cstdint>
#include <string_view>
#include <utility>

#include "page/access.hpp"
#include "spindle/base/clock.hpp"
#include "spindle/base/error.hpp"

namespace spindle::page {

/// Owns a descriptor.
class Socket {
 public:
  Socket() = default;
  explicit Socket(int descriptor) : descriptor_(descriptor) {}
  Socket(Socket&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}
  Socket& operator=(Socket&& other) noexcept {
    std::swap(descriptor_, other.descriptor_);
    return *this;
  }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  ~Socket();

  [[nodiscard]] int get() const { return descriptor_; }
  [[nodiscard]] bool is_open() const { return descriptor_ >= 0; }

 private:
  int descriptor_ = -1;
};

/// Listens there; port 0 becomes the one that the system chose. Errors: `port_busy` (another
/// program listens there), `port_unusable`.
Result<Socket> listen_on(ListenPlace& place);

/// Sends all of it within `patience`; false where that failed.
bool send_all(int socket, std::string_view bytes, Duration patience, const Clock& clock);

/// Lets the system end a connection whose other end acknowledges nothing for half a minute, as
/// where a network is gone: else it takes a quarter of an hour.
void end_when_unheard(int socket);

/// Whether the other end has gone, or will send no more.
bool is_gone(int socket);

}  // namespace spindle::page
