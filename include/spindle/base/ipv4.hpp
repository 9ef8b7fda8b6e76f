#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace spindle {

/// An address of IPv4 in its four decimal numbers, "192.168.10.23", as one number whose first byte
/// is the highest. Empty for anything else, also for numbers with leading zeros, which some
/// programs take for octal ones.
std::optional<std::uint32_t> parse_ipv4(std::string_view text);

/// "192.168.10.23".
std::string ipv4_text(std::uint32_t address);

/// The addresses of a network, both ends included.
struct Ipv4Network {
  std::uint32_t first = 0;
  std::uint32_t last = 0;
  int prefix = 32;  ///< bits that all have in common
};

/// "192.168.10.0/24", also with the address of a host in it, or one address. Empty for anything
/// else.
std::optional<Ipv4Network> parse_ipv4_network(std::string_view text);

}  // namespace spindle
