#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <string>

#include "spindle/base/bytes.hpp"
#include "spindle/catalogue/discovery.hpp"

namespace spindle::device {

/// What a tool said of itself on the network. Nothing of it is proven.
struct FoundTool {
  std::string serial = {};  ///< empty: not told
  std::optional<std::uint32_t> model = std::nullopt;
  std::string address = {};                          ///< "192.168.1.100"; empty: not told, or 0
  std::optional<std::uint16_t> port = std::nullopt;  ///< empty: not told, or 0
  std::string mac = {};                              ///< "00:11:22:33:44:55"; empty: none
  std::optional<std::uint32_t> firmware = std::nullopt;
  std::optional<bool> in_use = std::nullopt;
  std::optional<std::uint32_t> kind = std::nullopt;
  std::string kind_name = {};  ///< empty: the number is not known
};

/// The datagram that asks for tools.
Bytes discovery_question(const catalogue::DiscoverySpec& spec, std::uint16_t number);

/// What a datagram says of a tool; empty for one that is no answer to one of these questions: of
/// another length, number or type, or with a serial number that is no printable ASCII.
std::optional<FoundTool> decode_found(const catalogue::DiscoverySpec& spec,
                                      const std::set<std::uint16_t>& questions, ByteView datagram);

/// Tools that were found, each once however often and on however many interfaces it answers.
/// Bounded: what a flood says is left out from some number on.
class FoundTools {
 public:
  enum class Added : std::uint8_t { yes, known, no_room };
  /// A tool is known by its MAC, its serial number and where it is.
  Added add(const FoundTool& tool);
  static constexpr std::size_t most = 4096;

 private:
  std::set<std::string> keys_ = {};
};

}  // namespace spindle::device
