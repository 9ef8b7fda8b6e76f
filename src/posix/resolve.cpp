#include "posix/resolve.hpp"

#include <fmt/format.h>
#include <netdb.h>
#include <netinet/in.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <memory>
#include <span>
#include <system_error>
#include <thread>

#include "posix/descriptor.hpp"
#include "posix/socket_errors.hpp"
#include "posix/wait.hpp"

namespace spindle::posix {
namespace {

// More than a user waits for to fail one after the other; keeps the answer of a look-up one
// message of fixed size.
constexpr std::size_t max_addresses = 16;

// What getaddrinfo() said, as plain bytes that can travel through a socket.
struct Lookup {
  int status = 0;
  int error_number = 0;
  std::size_t count = 0;
  std::array<Address, max_addresses> addresses = {};

  [[nodiscard]] std::vector<Address> found() const {
    const std::span all(addresses);
    return {all.begin(), all.begin() + static_cast<std::ptrdiff_t>(count)};
  }
};

struct FreeAddresses {
  void operator()(addrinfo* list) const { ::freeaddrinfo(list); }
};

Lookup look_up(const std::string& host, std::uint16_t port, int flags) {
  addrinfo hints = {};
  hints.ai_family = AF_UNSPEC;
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = flags | AI_NUMERICSERV;

  Lookup lookup;
  addrinfo* raw = nullptr;
  lookup.status = ::getaddrinfo(host.c_str(), std::to_string(port).c_str(), &hints, &raw);
  lookup.error_number = errno;
  if (lookup.status != 0) return lookup;
  const std::unique_ptr<addrinfo, FreeAddresses> list(raw);
  for (const addrinfo* at = raw; at != nullptr && lookup.count < max_addresses; at = at->ai_next) {
    Address& address = lookup.addresses[lookup.count++];
    std::copy_n(reinterpret_cast<const std::byte*>(at->ai_addr), at->ai_addrlen,
                reinterpret_cast<std::byte*>(&address.storage));
    address.size = at->ai_addrlen;
  }
  return lookup;
}

// getaddrinfo() has neither a deadline nor a way to be stopped: it may hang in a name server's
// silence long after the answer is not wanted any more. So it runs in a thread that is never waited
// for. Everything that the thread touches is its own copy, and the answer travels as one message
// through a socket; once the reader is gone, sending fails and the thread ends by itself. A thread
// that still hangs when the process ends is ended with it.
Result<Descriptor> start_look_up(const std::string& host, std::uint16_t port) {
  std::array<int, 2> ends = {-1, -1};
  if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends.data()) != 0) {
    return tl::unexpected(connect_error(errno));
  }
  Descriptor reader(ends[0]);
  Descriptor writer(ends[1]);
  try {
    std::thread([host, port, answer = std::move(writer)] {
      const Lookup lookup = look_up(host, port, 0);
      ::send(answer.number(), &lookup, sizeof lookup, MSG_NOSIGNAL);
    }).detach();
  } catch (const std::system_error& failure) {
    return tl::unexpected(Error{
        .code = Errc::internal,
        .message = fmt::format("cannot start looking up '{}': {}", host, failure.code().message()),
        .hint = "close other programs, or use the tool's IP address"});
  }
  return reader;
}

Error silent_name_server(const std::string& host) { return resolve_error(EAI_AGAIN, 0, host); }

Result<Lookup> await_look_up(const std::string& host, std::uint16_t port, TimePoint deadline,
                             const Clock& clock, const Interrupt& interrupt) {
  const Result<Descriptor> answer = start_look_up(host, port);
  if (!answer) return tl::unexpected(answer.error());
  const Interest arrival = {.descriptor = answer->number(), .events = POLLIN};
  switch (wait_for(arrival, deadline, clock, interrupt)) {
    case Woken::interrupted:
      return tl::unexpected(interrupt.error());
    case Woken::deadline:
      return tl::unexpected(silent_name_server(host));
    case Woken::ready:
      break;
  }
  Lookup lookup;
  if (::recv(answer->number(), &lookup, sizeof lookup, 0) != sizeof lookup) {
    return tl::unexpected(silent_name_server(host));
  }
  return lookup;
}

}  // namespace

std::string to_text(const Address& address) {
  std::array<char, NI_MAXHOST> text = {};
  const int failure = ::getnameinfo(address.data(), address.size, text.data(), text.size(), nullptr,
                                    0, NI_NUMERICHOST);
  return failure == 0 ? text.data() : "unknown address";
}

std::uint16_t port_of(const Address& address) {
  if (address.storage.ss_family == AF_INET6) {
    return ntohs(reinterpret_cast<const sockaddr_in6*>(&address.storage)->sin6_port);
  }
  return ntohs(reinterpret_cast<const sockaddr_in*>(&address.storage)->sin_port);
}

Result<Resolved> resolve(const std::string& host, std::uint16_t port, TimePoint deadline,
                         const Clock& clock, const Interrupt& interrupt) {
  if (interrupt.raised()) return tl::unexpected(interrupt.error());
  const Lookup numeric = look_up(host, port, AI_NUMERICHOST);
  if (numeric.status == 0) return Resolved{Resolved::Given::address, numeric.found()};

  const Result<Lookup> lookup = await_look_up(host, port, deadline, clock, interrupt);
  if (!lookup) return tl::unexpected(lookup.error());
  if (lookup->status != 0) {
    return tl::unexpected(resolve_error(lookup->status, lookup->error_number, host));
  }
  return Resolved{Resolved::Given::name, lookup->found()};
}

}  // namespace spindle::posix
