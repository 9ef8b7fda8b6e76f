#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "spindle/base/bytes.hpp"
#include "spindle/base/clock.hpp"

namespace spindle::link {

/// A network interface of this computer with an IPv4 address.
struct NetworkInterface {
  std::string name;           ///< "eth0"
  std::string address;        ///< "192.168.10.2"
  bool is_up = false;         ///< it has a network
  bool is_multicast = false;  ///< it can send to groups
};

/// What one program sent in one piece.
struct Datagram {
  Bytes bytes = {};            ///< at most 2,048: what is longer is cut off there
  std::string from = {};       ///< address of the sender
  std::string interface = {};  ///< name of the one that heard it
};

/// Datagrams to one group on several interfaces, and what comes back. One thread.
class Datagrams {
 public:
  Datagrams() = default;
  Datagrams(const Datagrams&) = delete;
  Datagrams& operator=(const Datagrams&) = delete;
  virtual ~Datagrams() = default;

  /// Sends to the group on every interface. Returns the errors of those on which it cannot, each
  /// with the interface's name as its name.
  virtual std::vector<Error> send(ByteView bytes) = 0;

  /// The next datagram; empty at the deadline, which also ends a flood. Error: an interrupt.
  virtual Result<std::optional<Datagram>> receive(TimePoint deadline) = 0;
};

/// What a search for tools needs of the network.
struct Network {
  /// All interfaces with an IPv4 address. Error `no_route`: the system does not tell them.
  std::function<Result<std::vector<NetworkInterface>>()> interfaces = {};
  /// Sockets for a group (IPv4 address, UDP port), which they join on each of these interfaces.
  /// Error: none of them can be used; the errors of the others are told by `faults`.
  std::function<Result<std::unique_ptr<Datagrams>>(const std::vector<NetworkInterface>& interfaces,
                                                   const std::string& group, std::uint16_t port,
                                                   std::vector<Error>& faults)>
      open = {};
};

}  // namespace spindle::link
