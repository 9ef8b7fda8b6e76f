#include "spindle/catalogue/curve.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <numeric>

#include "catalogue/codec.hpp"
#include "spindle/catalogue/parameter.hpp"
#include "spindle/modbus/pdu.hpp"

namespace spindle::catalogue {
namespace {

constexpr std::size_t sample_size = 4;
constexpr std::size_t length_size = 2;

tl::unexpected<std::string> no_frame(std::string why) { return tl::unexpected(std::move(why)); }

template <typename List>
const auto* entry_of(const List& list, std::int64_t number) {
  const auto found = std::find_if(list.begin(), list.end(),
                                  [number](const auto& entry) { return entry.number == number; });
  return found == list.end() ? nullptr : &*found;
}

std::uint16_t register_of(const EventLayout& layout, std::string_view name, RegisterView block) {
  const EventLayout::Field* field = layout.find(name);
  return field == nullptr ? std::uint16_t{0} : block[field->at];
}

Registers registers_in(ByteView data) {
  Registers registers;
  registers.reserve(data.size() / 2);
  for (std::size_t at = 0; at + 1 < data.size(); at += 2) registers.push_back(get_u16(data, at));
  return registers;
}

Bytes part_of(ByteView data, std::size_t first, std::size_t size) {
  const ByteView part = data.subspan(first, size);
  return {part.begin(), part.end()};
}

ChannelFacts channel_facts(const CurveSpec& curves, const CurveChannel& channel,
                           const EventLayout& layout, RegisterView block,
                           const std::string& torque) {
  ChannelFacts facts = {.type = register_of(layout, channel.type, block),
                        .count = register_of(layout, channel.count, block)};
  if (const auto* type = entry_of(curves.types, facts.type)) {
    facts.is = type->is;
    facts.unit = type->unit == catalogue::torque_unit ? torque : type->unit.to_string();
  }
  if (const EventLayout::Field* field = layout.find(channel.type)) {
    const Label* label = entry_of(field->parameter->labels, facts.type);
    if (label != nullptr) facts.name = label->text.to_string();
  }
  return facts;
}

}  // namespace

EventFrames::EventFrames(const Profile& profile) : facts_(&*profile.events) {
  if (!facts_->curves) return;
  const EventLayout layout(profile);
  for (const CurveChannel& channel : facts_->curves->channels) {
    const EventLayout::Field* field = layout.find(channel.count);
    count_at_.push_back(field == nullptr ? 0 : field->at);
  }
}

bool EventFrames::holds_event(std::uint8_t function) const {
  return std::none_of(facts_->frames.begin(), facts_->frames.end(), [&](const EventFrame& frame) {
    return frame.function == function && frame.holds == FrameContent::curve;
  });
}

std::vector<std::size_t> EventFrames::counts_of(RegisterView block) const {
  std::vector<std::size_t> counts;
  for (const std::size_t at : count_at_) counts.push_back(block[at]);
  return counts;
}

EventFrames::Decoded EventFrames::decode(const modbus::Pdu& pdu) const {
  const std::size_t block_size = 2 * std::size_t{facts_->count};
  const ByteView data = pdu.data;
  const bool counts_bytes = pdu.function == facts_->function;
  if (counts_bytes) {
    if (data.empty() || data.front() != block_size || data.size() != 1 + block_size) {
      return no_frame("its byte count is not that of an event");
    }
    return PushedFrame{.block = modbus::registers_of(pdu)};
  }
  const auto* frame = std::find_if(facts_->frames.begin(), facts_->frames.end(),
                                   [&](const auto& one) { return one.function == pdu.function; });
  if (frame == facts_->frames.end()) return no_frame("its function is not known");
  if (data.size() < length_size || get_u16(data, 0) + length_size != data.size()) {
    return no_frame("its length is not that of its data");
  }
  const ByteView behind = data.subspan(length_size);
  switch (frame->holds) {
    case FrameContent::event:
      return decode_event(behind);
    case FrameContent::event_with_curves:
      return decode_event_with_curves(behind);
    case FrameContent::curve:
      break;
  }
  return decode_curve(behind);
}

EventFrames::Decoded EventFrames::decode_event(ByteView data) const {
  if (data.size() != 2 * std::size_t{facts_->count}) {
    return no_frame(fmt::format("{} bytes are not those of an event", data.size()));
  }
  return PushedFrame{.block = registers_in(data)};
}

EventFrames::Decoded EventFrames::decode_event_with_curves(ByteView data) const {
  const std::size_t block_size = 2 * std::size_t{facts_->count};
  if (data.size() < block_size || !facts_->curves) return no_frame("it holds no whole event");
  PushedFrame frame = {.block = registers_in(data.first(block_size))};
  const std::vector<std::size_t> counts = counts_of(*frame.block);
  const std::size_t samples = std::accumulate(counts.begin(), counts.end(), std::size_t{0});
  const bool fits = data.size() == block_size + sample_size * samples;
  const bool is_within = std::all_of(counts.begin(), counts.end(), [&](std::size_t count) {
    return count <= facts_->curves->most;
  });
  if (!fits || !is_within) {
    return no_frame(fmt::format("{} bytes of samples are not the {} samples that it counts",
                                data.size() - block_size, samples));
  }
  std::size_t at = block_size;
  for (std::size_t channel = 0; channel < counts.size(); ++channel) {
    const std::size_t size = sample_size * counts[channel];
    if (size > 0) {
      frame.channels.push_back({.channel = channel, .samples = part_of(data, at, size)});
    }
    at += size;
  }
  return frame;
}

EventFrames::Decoded EventFrames::decode_curve(ByteView data) const {
  constexpr std::size_t head = 4;
  if (data.size() < head || !facts_->curves) return no_frame("it holds no channel");
  const std::size_t channel = get_u16(data, 0);
  const std::size_t count = get_u16(data, 2);
  if (channel < 1 || channel > facts_->curves->channels.size()) {
    return no_frame(fmt::format("there is no channel {}", channel));
  }
  if (count > facts_->curves->most || data.size() != head + sample_size * count) {
    return no_frame(fmt::format("{} bytes of samples are not the {} samples that it counts",
                                data.size() - head, count));
  }
  PushedFrame frame;
  frame.channels.push_back(
      {.channel = channel - 1, .samples = part_of(data, head, sample_size * count)});
  return frame;
}

std::vector<float> to_samples(ByteView bytes) {
  std::vector<float> samples(bytes.size() / sample_size);
  const std::uint8_t* byte = bytes.data();
  for (float& sample : samples) {
    const std::uint32_t pattern = (std::uint32_t{byte[0]} << 24U) |
                                  (std::uint32_t{byte[1]} << 16U) | (std::uint32_t{byte[2]} << 8U) |
                                  std::uint32_t{byte[3]};
    sample = std::bit_cast<float>(pattern);
    byte += sample_size;
  }
  return samples;
}

std::optional<Decimal> to_decimal(float sample) {
  return float_of(Kind::f32, std::bit_cast<std::uint32_t>(sample)).number;
}

CurveFacts curve_facts(const Profile& profile, const EventLayout& layout, RegisterView block,
                       std::string_view unit_of_tool) {
  const CurveSpec& curves = *profile.events->curves;
  const std::string torque = layout.torque_unit_of(block, unit_of_tool);
  CurveFacts facts = {.sampling_ms = register_of(layout, curves.sampling, block)};
  for (const CurveChannel& channel : curves.channels) {
    facts.channels.push_back(channel_facts(curves, channel, layout, block, torque));
  }
  for (std::size_t step = 0; step < curves.steps; ++step) {
    const std::size_t at = curves.first_step + 2 * step;
    const std::uint16_t type = block[at];
    if (type == 0) continue;
    const Label* label = entry_of(curves.step_types, type);
    facts.steps.push_back(
        {.type = type,
         .name = label == nullptr ? fmt::format("step {}", type) : label->text.to_string(),
         .sample = block[at + 1]});
  }
  return facts;
}

}  // namespace spindle::catalogue
