#include "page/sockets.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <system_error>

namespace spindle::page {
namespace {

/// An address of either version, as the system takes it.
struct Address {
  sockaddr_storage bytes = {};
  socklen_t length = 0;
};

/// Requires an address of parse_listen().
Address address_of(const ListenPlace& place) {
  Address address;
  sockaddr_in6 six = {};
  if (::inet_pton(AF_INET6, place.address.c_str(), &six.sin6_addr) == 1) {
    six.sin6_family = AF_INET6;
    six.sin6_port = htons(place.port);
    std::memcpy(&address.bytes, &six, sizeof six);
    address.length = sizeof six;
    return address;
  }
  sockaddr_in four = {};
  ::inet_pton(AF_INET, place.address.c_str(), &four.sin_addr);
  four.sin_family = AF_INET;
  four.sin_port = htons(place.port);
  std::memcpy(&address.bytes, &four, sizeof four);
  address.length = sizeof four;
  return address;
}

sockaddr* raw(Address& address) { return reinterpret_cast<sockaddr*>(&address.bytes); }

Error failure(const ListenPlace& place, int number) {
  const bool is_busy = number == EADDRINUSE;
  return {.code = is_busy ? Errc::port_busy : Errc::port_unusable,
          .message = is_busy ? "another program listens there"
                             : "cannot listen there: " + std::generic_category().message(number),
          .hint = "name another place by --listen",
          .name = url_of(place)};
}

}  // namespace

Socket::~Socket() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

Result<Socket> listen_on(ListenPlace& place) {
  Address address = address_of(place);
  constexpr int backlog = 128;
  constexpr int on = 1;
  Socket socket(::socket(address.bytes.ss_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  // No SO_REUSEPORT: two programs on one port would share its clients in silence.
  const bool listens = socket.is_open() &&
                       ::setsockopt(socket.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on) == 0 &&
                       ::bind(socket.get(), raw(address), address.length) == 0 &&
                       ::listen(socket.get(), backlog) == 0 &&
                       ::getsockname(socket.get(), raw(address), &address.length) == 0;
  if (!listens) return tl::unexpected(failure(place, errno));
  // Both versions have the port at the same place.
  sockaddr_in named = {};
  std::memcpy(&named, &address.bytes, sizeof named);
  place.port = ntohs(named.sin_port);
  return socket;
}

bool send_all(int socket, std::string_view bytes, Duration patience, const Clock& clock) {
  const TimePoint end = clock.now() + patience;
  while (!bytes.empty()) {
    const ssize_t sent = ::send(socket, bytes.data(), bytes.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
    if (sent > 0) {
      bytes.remove_prefix(static_cast<std::size_t>(sent));
      continue;
    }
    if (sent < 0 && errno == EINTR) continue;
    if (sent < 0 && errno != EAGAIN && errno != EWOULDBLOCK) return false;
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(end - clock.now()).count();
    if (left <= 0) return false;
    pollfd waiting = {.fd = socket, .events = POLLOUT, .revents = 0};
    ::poll(&waiting, 1, static_cast<int>(left));
  }
  return true;
}

void end_when_unheard(int socket) {
  constexpr unsigned milliseconds = 30'000;
  ::setsockopt(socket, IPPROTO_TCP, TCP_USER_TIMEOUT, &milliseconds, sizeof milliseconds);
}

bool is_gone(int socket) {
  pollfd looked = {.fd = socket, .events = POLLRDHUP, .revents = 0};
  return ::poll(&looked, 1, 0) > 0 && (looked.revents & (POLLRDHUP | POLLERR | POLLHUP)) != 0;
}

}  // namespace spindle::page
