#include "spindle/device/discovery.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "spindle/base/ipv4.hpp"

namespace spindle::device {
namespace {

using catalogue::Slice;

constexpr std::size_t head_bytes = 4;

/// 224.0.0.0: from here on no address is that of one computer (RFC 1112, section 4; RFC 919).
constexpr std::uint32_t first_group = 0xE0000000;

ByteView part_of(ByteView answer, const Slice& slice) {
  return answer.subspan(slice.offset, slice.size);
}

std::optional<std::uint32_t> number_in(ByteView answer, const Slice& slice) {
  if (slice.size == 0) return std::nullopt;
  std::uint32_t number = 0;
  for (const std::uint8_t byte : part_of(answer, slice)) number = (number << 8U) | byte;
  return number;
}

/// Up to the first zero, without the blanks around it; empty optional: not printable.
std::optional<std::string> text_in(ByteView answer, const Slice& slice) {
  std::string text;
  for (const std::uint8_t byte : part_of(answer, slice)) {
    if (byte == 0) break;
    if (byte < ' ' || byte > '~') return std::nullopt;
    text += static_cast<char>(byte);
  }
  const std::size_t begin = std::min(text.find_first_not_of(' '), text.size());
  return text.substr(begin, text.find_last_not_of(' ') + 1 - begin);
}

std::string mac_in(ByteView answer, const Slice& slice) {
  const ByteView mac = part_of(answer, slice);
  if (std::all_of(mac.begin(), mac.end(), [](auto byte) { return byte == 0; })) return {};
  return fmt::format("{:02x}", fmt::join(mac, ":"));
}

}  // namespace

Bytes discovery_question(const catalogue::DiscoverySpec& spec, std::uint16_t number) {
  Bytes question;
  put_u16(question, number);
  put_u16(question, spec.ask);
  return question;
}

std::optional<FoundTool> decode_found(const catalogue::DiscoverySpec& spec,
                                      const std::set<std::uint16_t>& questions, ByteView datagram) {
  if (datagram.size() != head_bytes + spec.bytes) return std::nullopt;
  if (!questions.contains(get_u16(datagram, 0)) || get_u16(datagram, 2) != spec.answer) {
    return std::nullopt;
  }
  const ByteView answer = datagram.subspan(head_bytes);
  auto serial = text_in(answer, spec.serial);
  if (!serial) return std::nullopt;
  FoundTool tool{.serial = std::move(*serial),
                 .model = number_in(answer, spec.model),
                 .mac = mac_in(answer, spec.mac),
                 .firmware = number_in(answer, spec.firmware),
                 .kind = number_in(answer, spec.kind)};
  const auto address = number_in(answer, spec.address).value_or(0);
  if (address >= first_group) return std::nullopt;  // no tool can be there
  if (address != 0) {
    tool.address = ipv4_text(address);
  }
  if (const auto port = number_in(answer, spec.tool_port).value_or(0); port != 0) {
    tool.port = static_cast<std::uint16_t>(port);
  }
  if (const auto in_use = number_in(answer, spec.in_use)) tool.in_use = *in_use != 0;
  if (tool.kind) {
    const catalogue::Text* name = spec.kinds.find(*tool.kind);
    if (name != nullptr) tool.kind_name = name->to_string();
  }
  return tool;
}

FoundTools::Added FoundTools::add(const FoundTool& tool) {
  std::string key =
      fmt::format("{} {} {} {}", tool.mac, tool.serial, tool.address, tool.port.value_or(0));
  if (keys_.contains(key)) return Added::known;
  if (keys_.size() >= most) return Added::no_room;
  keys_.insert(std::move(key));
  return Added::yes;
}

}  // namespace spindle::device
