#pragma once

#include <netinet/in.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdint>
#include <string>

#include "posix/descriptor.hpp"
#include "spindle/base/clock.hpp"
#include "spindle/base/interrupt.hpp"

/// Sockets of the loopback interface, made without the code under test.
namespace spindle::test {

/// An Interrupt that wakes every poll when it is raised, as the signal handler's does.
class WakingInterrupt {
 public:
  void raise(int signal_number) {
    interrupt_.raise(signal_number);
    const std::uint64_t one = 1;
    if (::write(wake_.number(), &one, sizeof one) != sizeof one) std::abort();
  }
  [[nodiscard]] const Interrupt& get() const { return interrupt_; }

 private:
  posix::Descriptor wake_{::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)};
  Interrupt interrupt_{wake_.number()};
};

inline sockaddr_in loopback_address(std::uint16_t port) {
  sockaddr_in address = {};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  return address;
}

inline std::uint16_t local_port(int socket) {
  sockaddr_in6 address = {};  // the port is at the same place in both families
  socklen_t size = sizeof address;
  ::getsockname(socket, reinterpret_cast<sockaddr*>(&address), &size);
  return ntohs(address.sin6_port);
}

/// A bound socket on 127.0.0.1 that does not listen: connecting to its port is refused.
class BoundSocket {
 public:
  BoundSocket() {
    const sockaddr_in address = loopback_address(0);
    ::bind(socket_.number(), reinterpret_cast<const sockaddr*>(&address), sizeof address);
  }
  [[nodiscard]] std::uint16_t port() const { return local_port(socket_.number()); }
  [[nodiscard]] int number() const { return socket_.number(); }

 private:
  posix::Descriptor socket_{::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)};
};

/// The other end: accepts connections on 127.0.0.1.
class Acceptor {
 public:
  explicit Acceptor(int backlog = 8) { ::listen(bound_.number(), backlog); }
  [[nodiscard]] std::uint16_t port() const { return bound_.port(); }
  [[nodiscard]] int number() const { return bound_.number(); }
  [[nodiscard]] posix::Descriptor accept() const {
    return posix::Descriptor(::accept4(bound_.number(), nullptr, nullptr, SOCK_CLOEXEC));
  }

 private:
  BoundSocket bound_;
};

/// A plain blocking client socket; reads give up after two seconds.
inline posix::Descriptor connect_plainly(std::uint16_t port) {
  posix::Descriptor socket(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  const timeval patience = {.tv_sec = 2, .tv_usec = 0};
  ::setsockopt(socket.number(), SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  const sockaddr_in address = loopback_address(port);
  if (::connect(socket.number(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
    socket.close();
  return socket;
}

}  // namespace spindle::test
