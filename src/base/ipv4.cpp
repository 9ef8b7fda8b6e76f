#include "spindle/base/ipv4.hpp"

#include <fmt/format.h>

#include "spindle/base/text.hpp"

namespace spindle {

std::optional<std::uint32_t> parse_ipv4(std::string_view text) {
  const auto parts = split(text, '.');
  constexpr std::size_t bytes = 4;
  if (parts.size() != bytes) return std::nullopt;
  std::uint32_t address = 0;
  for (const std::string_view part : parts) {
    const bool is_plain = part == "0" || (!part.starts_with('0') && part.size() <= 3);
    const auto byte = is_plain ? parse_unsigned(part, 0xFF) : std::nullopt;
    if (!byte) return std::nullopt;
    address = (address << 8U) | static_cast<std::uint32_t>(*byte);
  }
  return address;
}

std::string ipv4_text(std::uint32_t address) {
  return fmt::format("{}.{}.{}.{}", address >> 24U, (address >> 16U) & 0xFFU,
                     (address >> 8U) & 0xFFU, address & 0xFFU);
}

std::optional<Ipv4Network> parse_ipv4_network(std::string_view text) {
  constexpr unsigned bits = 32;
  const std::size_t slash = text.find('/');
  const auto address = parse_ipv4(text.substr(0, slash));
  if (!address) return std::nullopt;
  if (slash == std::string_view::npos) return Ipv4Network{*address, *address, bits};
  const auto prefix = parse_unsigned(text.substr(slash + 1), bits);
  if (!prefix) return std::nullopt;
  const std::uint32_t hosts =
      *prefix == 0 ? ~std::uint32_t{0}
                   : static_cast<std::uint32_t>((std::uint64_t{1} << (bits - *prefix)) - 1);
  return Ipv4Network{*address & ~hosts, *address | hosts, static_cast<int>(*prefix)};
}

}  // namespace spindle
