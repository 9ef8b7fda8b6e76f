#include "spindle/posix/datagrams.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <system_error>

#include "posix/descriptor.hpp"
#include "posix/wait.hpp"

namespace spindle::posix {
namespace {

constexpr std::size_t largest_datagram = 2048;

// The ports from which the makers of tools ask.
constexpr unsigned first_port = 50'000;
constexpr unsigned port_count = 10'000;
constexpr unsigned most_tried_ports = 64;

std::string text_of(const in_addr& address) {
  std::array<char, INET_ADDRSTRLEN> text = {};
  return ::inet_ntop(AF_INET, &address, text.data(), text.size()) == nullptr ? std::string()
                                                                             : text.data();
}

Error interface_error(int error_number, const std::string& interface) {
  return {.code = Errc::no_route,
          .message = fmt::format("cannot be used to look for tools: {}",
                                 std::generic_category().message(error_number)),
          .hint = "choose others with --interface",
          .name = interface};
}

Result<std::vector<link::NetworkInterface>> list_interfaces() {
  ifaddrs* first = nullptr;
  if (::getifaddrs(&first) != 0) {
    return tl::unexpected(Error{.code = Errc::no_route,
                                .message = fmt::format("the network interfaces are not known: {}",
                                                       std::generic_category().message(errno))});
  }
  const std::unique_ptr<ifaddrs, decltype(&::freeifaddrs)> list(first, &::freeifaddrs);
  std::vector<link::NetworkInterface> interfaces;
  for (const ifaddrs* each = list.get(); each != nullptr; each = each->ifa_next) {
    if (each->ifa_addr == nullptr || each->ifa_addr->sa_family != AF_INET) continue;
    const auto* address = reinterpret_cast<const sockaddr_in*>(each->ifa_addr);
    constexpr unsigned up = IFF_UP | IFF_RUNNING;
    interfaces.push_back({.name = each->ifa_name,
                          .address = text_of(address->sin_addr),
                          .is_up = (each->ifa_flags & up) == up,
                          .is_multicast = (each->ifa_flags & IFF_MULTICAST) != 0});
  }
  return interfaces;
}

/// Any port that is free, of the usual ones where there is one.
bool bind_to_port(const Descriptor& socket) {
  sockaddr_in any = {};
  any.sin_family = AF_INET;
  const auto begin = static_cast<unsigned>(::getpid()) % port_count;
  for (unsigned tried = 0; tried <= most_tried_ports; ++tried) {
    const unsigned port = tried == most_tried_ports ? 0 : first_port + (begin + tried) % port_count;
    any.sin_port = htons(static_cast<std::uint16_t>(port));
    if (::bind(socket.number(), reinterpret_cast<const sockaddr*>(&any), sizeof any) == 0) {
      return true;
    }
    if (errno != EADDRINUSE) return false;
  }
  return false;
}

template <typename Value>
bool set(const Descriptor& socket, int option, const Value& value) {
  return ::setsockopt(socket.number(), IPPROTO_IP, option, &value, sizeof value) == 0;
}

struct Ear {
  Descriptor socket;
  std::string interface;
};

/// Answers come to the port that asked, or to the group at that port.
Result<Ear> open_on(const link::NetworkInterface& interface, const in_addr& group) {
  const auto failed = [&] { return tl::unexpected(interface_error(errno, interface.name)); };
  Descriptor socket(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (!socket.valid()) return failed();
  ip_mreqn membership = {};
  membership.imr_multiaddr = group;
  ::inet_pton(AF_INET, interface.address.c_str(), &membership.imr_address);
  membership.imr_ifindex = static_cast<int>(::if_nametoindex(interface.name.c_str()));
  if (membership.imr_ifindex == 0) return failed();
  const int only_own_groups = 0;
  const bool is_ready = set(socket, IP_MULTICAST_IF, membership) &&
                        set(socket, IP_MULTICAST_ALL, only_own_groups) && bind_to_port(socket) &&
                        set(socket, IP_ADD_MEMBERSHIP, membership);
  if (!is_ready) return failed();
  return Ear{std::move(socket), interface.name};
}

class GroupSockets final : public link::Datagrams {
 public:
  GroupSockets(std::vector<Ear> ears, const sockaddr_in& group, const Clock& clock,
               const Interrupt& interrupt)
      : ears_(std::move(ears)), group_(group), clock_(&clock), interrupt_(&interrupt) {}

  std::vector<Error> send(ByteView bytes) override;
  Result<std::optional<link::Datagram>> receive(TimePoint deadline) override;

 private:
  std::optional<link::Datagram> take();

  std::vector<Ear> ears_;
  sockaddr_in group_;
  const Clock* clock_;
  const Interrupt* interrupt_;
  std::size_t turn_ = 0;  ///< whose datagram is taken next, so that a flood drowns no other
};

std::vector<Error> GroupSockets::send(ByteView bytes) {
  std::vector<Error> faults;
  for (const Ear& ear : ears_) {
    const auto* to = reinterpret_cast<const sockaddr*>(&group_);
    const ssize_t sent =
        ::sendto(ear.socket.number(), bytes.data(), bytes.size(), MSG_NOSIGNAL, to, sizeof group_);
    if (sent < 0) faults.push_back(interface_error(errno, ear.interface));
  }
  return faults;
}

/// What is there of the first that has something, from the one whose turn it is.
std::optional<link::Datagram> GroupSockets::take() {
  std::array<std::uint8_t, largest_datagram> bytes = {};
  for (std::size_t tried = 0; tried < ears_.size(); ++tried) {
    const Ear& ear = ears_[turn_++ % ears_.size()];
    sockaddr_in from = {};
    socklen_t size = sizeof from;
    const ssize_t received = ::recvfrom(ear.socket.number(), bytes.data(), bytes.size(), 0,
                                        reinterpret_cast<sockaddr*>(&from), &size);
    if (received < 0) continue;  // nothing there, or word that an earlier one was not delivered
    return link::Datagram{.bytes = Bytes(bytes.begin(), bytes.begin() + received),
                          .from = text_of(from.sin_addr),
                          .interface = ear.interface};
  }
  return std::nullopt;
}

Result<std::optional<link::Datagram>> GroupSockets::receive(TimePoint deadline) {
  std::vector<pollfd> waited;
  for (const Ear& ear : ears_) waited.push_back({ear.socket.number(), POLLIN, 0});
  waited.push_back({interrupt_->descriptor(), POLLIN, 0});
  for (;;) {
    if (interrupt_->raised()) return tl::unexpected(interrupt_->error());
    if (clock_->now() >= deadline) return std::nullopt;
    if (auto datagram = take()) return datagram;
    static_cast<void>(poll_until(waited, deadline, *clock_));
  }
}

}  // namespace

link::Network network(const Clock& clock, const Interrupt& interrupt) {
  return {.interfaces = list_interfaces,
          .open = [&clock, &interrupt](
                      const std::vector<link::NetworkInterface>& interfaces,
                      const std::string& group, std::uint16_t port,
                      std::vector<Error>& faults) -> Result<std::unique_ptr<link::Datagrams>> {
            sockaddr_in to = {};
            to.sin_family = AF_INET;
            to.sin_port = htons(port);
            ::inet_pton(AF_INET, group.c_str(), &to.sin_addr);
            std::vector<Ear> ears;
            for (const link::NetworkInterface& interface : interfaces) {
              auto ear = open_on(interface, to.sin_addr);
              if (ear) {
                ears.push_back(std::move(*ear));
              } else {
                faults.push_back(std::move(ear.error()));
              }
            }
            if (ears.empty() && !faults.empty()) {
              Error error = std::move(faults.back());
              faults.pop_back();
              return tl::unexpected(std::move(error));
            }
            return std::make_unique<GroupSockets>(std::move(ears), to, clock, interrupt);
          }};
}

}  // namespace spindle::posix
