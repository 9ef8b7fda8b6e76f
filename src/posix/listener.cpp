#include "posix/listener.hpp"

#include <fmt/format.h>
#include <sys/socket.h>

#include <cerrno>

#include "posix/resolve.hpp"
#include "posix/socket_errors.hpp"

namespace spindle::posix {
namespace {

// The name of one's own computer is known at once or not at all.
constexpr Duration resolve_timeout = std::chrono::seconds(5);

Result<Listener> listen_at(const Address& address) {
  const auto failed = [&address] {
    const int failure = errno;
    return tl::unexpected(
        listen_error(failure, fmt::format("{} port {}", to_text(address), port_of(address))));
  };
  Descriptor socket(
      ::socket(address.storage.ss_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (!socket.valid()) return failed();
  // A simulator that is started again must not wait for old connections to be forgotten.
  const int reuse = 1;
  ::setsockopt(socket.number(), SOL_SOCKET, SO_REUSEADDR, &reuse, sizeof reuse);
  if (::bind(socket.number(), address.data(), address.size) != 0) return failed();
  if (::listen(socket.number(), SOMAXCONN) != 0) return failed();

  Address bound;
  bound.size = sizeof bound.storage;
  auto* const into = reinterpret_cast<sockaddr*>(&bound.storage);
  if (::getsockname(socket.number(), into, &bound.size) != 0) return failed();
  return Listener{std::move(socket), port_of(bound)};
}

}  // namespace

Result<Listener> listen_on(const std::string& host, std::uint16_t port, const Clock& clock,
                           const Interrupt& interrupt) {
  const Result<Resolved> resolved =
      resolve(host, port, clock.now() + resolve_timeout, clock, interrupt);
  if (!resolved) {
    Error error = resolved.error();
    if (error.code == Errc::name_not_found) {
      error.code = Errc::port_unusable;
      error.hint = "give an address of this computer, such as 127.0.0.1";
    }
    return tl::unexpected(std::move(error));
  }
  Result<Listener> listener = listen_at(resolved->addresses.front());
  for (std::size_t next = 1; !listener && next < resolved->addresses.size(); ++next) {
    listener = listen_at(resolved->addresses[next]);
  }
  return listener;
}

}  // namespace spindle::posix
