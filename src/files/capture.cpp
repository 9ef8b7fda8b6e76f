#include "spindle/files/capture.hpp"

#include <array>
#include <chrono>

namespace spindle::files {
namespace {

// pcapng: block types, options, and the byte order mark.
constexpr std::uint32_t section_header = 0x0A0D0D0A;
constexpr std::uint32_t interface_description = 1;
constexpr std::uint32_t enhanced_packet = 6;
constexpr std::uint32_t byte_order_mark = 0x1A2B3C4D;
constexpr std::uint16_t option_end = 0;
constexpr std::uint16_t option_comment = 1;
constexpr std::uint16_t link_upper_pdu = 252;

// Tags in front of an upper PDU (Wireshark, exported_pdu.h), in network byte order.
constexpr std::uint16_t tag_end = 0;
constexpr std::uint16_t tag_dissector = 12;
constexpr std::uint16_t tag_ipv4_source = 20;
constexpr std::uint16_t tag_ipv4_destination = 21;
constexpr std::uint16_t tag_port_type = 24;
constexpr std::uint16_t tag_source_port = 25;
constexpr std::uint16_t tag_destination_port = 26;
constexpr std::uint32_t port_type_tcp = 2;

// RFC 5737: addresses for documentation, because a serial line has none.
constexpr std::uint32_t client_address = 0xC0000201;
constexpr std::uint32_t server_address = 0xC0000202;
constexpr std::uint32_t client_port = 40000;
constexpr std::uint32_t server_port = 502;

constexpr std::size_t alignment = 4;

template <typename Integer>
void put_little(std::string& into, Integer value) {
  for (std::size_t byte = 0; byte < sizeof value; ++byte) {
    into.push_back(static_cast<char>((std::uint64_t{value} >> (8 * byte)) & 0xFFU));
  }
}

template <typename Integer>
void put_big(std::string& into, Integer value) {
  for (std::size_t byte = sizeof value; byte > 0; --byte) {
    into.push_back(static_cast<char>((std::uint64_t{value} >> (8 * (byte - 1))) & 0xFFU));
  }
}

void pad(std::string& into) {
  into.append((alignment - into.size() % alignment) % alignment, '\0');
}

std::string block(std::uint32_t type, const std::string& body) {
  constexpr std::uint32_t frame_size = 12;
  const auto size = static_cast<std::uint32_t>(body.size()) + frame_size;
  std::string text;
  put_little(text, type);
  put_little(text, size);
  text += body;
  put_little(text, size);
  return text;
}

void put_tag(std::string& into, std::uint16_t tag, std::string_view value) {
  put_big(into, tag);
  const std::size_t padded = (value.size() + alignment - 1) / alignment * alignment;
  put_big(into, static_cast<std::uint16_t>(padded));
  into += value;
  into.append(padded - value.size(), '\0');
}

void put_tag(std::string& into, std::uint16_t tag, std::uint32_t value) {
  std::string bytes;
  put_big(bytes, value);
  put_tag(into, tag, bytes);
}

std::string upper_pdu(const CapturedFrame& frame) {
  const bool sent = frame.sender == Sender::client;
  std::string text;
  put_tag(text, tag_dissector, frame.framing == modbus::Framing::tcp ? "mbtcp" : "mbrtu");
  put_tag(text, tag_ipv4_source, sent ? client_address : server_address);
  put_tag(text, tag_ipv4_destination, sent ? server_address : client_address);
  put_tag(text, tag_port_type, port_type_tcp);
  put_tag(text, tag_source_port, sent ? client_port : server_port);
  put_tag(text, tag_destination_port, sent ? server_port : client_port);
  put_big(text, tag_end);
  put_big(text, std::uint16_t{0});
  for (const std::uint8_t byte : frame.bytes) text.push_back(static_cast<char>(byte));
  return text;
}

}  // namespace

std::string capture_head() {
  std::string section;
  put_little(section, byte_order_mark);
  put_little(section, std::uint16_t{1});  // version 1.0
  put_little(section, std::uint16_t{0});
  put_little(section, ~std::uint64_t{0});  // of unknown length
  std::string interface;
  put_little(interface, link_upper_pdu);
  put_little(interface, std::uint16_t{0});
  put_little(interface, std::uint32_t{0});  // packets of any length; times in microseconds
  return block(section_header, section) + block(interface_description, interface);
}

std::string capture_block(const CapturedFrame& frame) {
  const auto time = static_cast<std::uint64_t>(
      std::chrono::duration_cast<std::chrono::microseconds>(frame.time.time_since_epoch()).count());
  const std::string packet = upper_pdu(frame);
  std::string body;
  put_little(body, std::uint32_t{0});  // the one interface
  put_little(body, static_cast<std::uint32_t>(time >> 32U));
  put_little(body, static_cast<std::uint32_t>(time));
  put_little(body, static_cast<std::uint32_t>(packet.size()));
  put_little(body, static_cast<std::uint32_t>(packet.size()));
  body += packet;
  pad(body);
  put_little(body, option_comment);
  put_little(body, static_cast<std::uint16_t>(frame.target.size()));
  body += frame.target;
  pad(body);
  put_little(body, option_end);
  put_little(body, std::uint16_t{0});
  return block(enhanced_packet, body);
}

}  // namespace spindle::files
