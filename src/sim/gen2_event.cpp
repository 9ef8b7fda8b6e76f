#include "gen2_event.hpp"

#include <algorithm>
#include <bit>

namespace spindle::sim {
namespace {

constexpr std::size_t block_size = 214;

void put_float(Bytes& bytes, float value) {
  constexpr unsigned bits_per_word = 16;
  const auto bits = std::bit_cast<std::uint32_t>(value);
  put_u16(bytes, static_cast<std::uint16_t>(bits >> bits_per_word));
  put_u16(bytes, static_cast<std::uint16_t>(bits & 0xFFFFU));
}

void put_date(Bytes& bytes, const Gen2Event::Date& date) {
  put_u16(bytes, date.year);
  for (const std::uint8_t byte :
       {date.month, date.day, date.hour, date.minute, date.second, date.fraction}) {
    bytes.push_back(byte);
  }
}

void put_text(Bytes& bytes, const std::string& text, std::size_t size) {
  const std::size_t end = bytes.size() + size;
  bytes.insert(bytes.end(), text.begin(),
               text.begin() + static_cast<std::ptrdiff_t>(std::min(text.size(), size)));
  bytes.resize(end, 0);
}

}  // namespace

Registers block_of(const Gen2Event& event) {
  constexpr std::uint16_t revision = 1;  // 0.1
  constexpr std::size_t reserved = 14;
  constexpr std::size_t barcode_size = 64;
  Bytes bytes;
  bytes.reserve(block_size);
  put_u16(bytes, revision);
  put_u16(bytes, event.number);
  put_date(bytes, event.date);
  for (const std::uint16_t word :
       {event.fastening_time, event.preset, event.torque_unit, event.screws_remaining,
        event.direction, event.error, event.status}) {
    put_u16(bytes, word);
  }
  for (const float torque : {event.target_torque, event.torque, event.seating_torque,
                             event.clamp_torque, event.prevailing_torque, event.snug_torque}) {
    put_float(bytes, torque);
  }
  for (const std::uint16_t word : {event.speed, event.a1, event.a2, event.a3, event.snug_angle}) {
    put_u16(bytes, word);
  }
  bytes.resize(bytes.size() + reserved, 0);
  put_u16(bytes, event.sync_id);
  put_text(bytes, event.barcode, barcode_size);
  for (const Gen2Event::Curve& curve : event.curves) put_u16(bytes, curve.type);
  for (const Gen2Event::Curve& curve : event.curves) put_u16(bytes, curve.samples);
  put_u16(bytes, event.sampling);
  for (const Gen2Event::Step& step : event.steps) {
    put_u16(bytes, step.type);
    put_u16(bytes, step.start);
  }
  Registers registers;
  for (std::size_t at = 0; at + 1 < bytes.size(); at += 2) registers.push_back(get_u16(bytes, at));
  return registers;
}

}  // namespace spindle::sim
