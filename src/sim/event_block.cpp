#include "event_block.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <iterator>
#include <span>

#include "spindle/catalogue/encoding.hpp"
#include "spindle/modbus/pdu.hpp"

namespace spindle::sim {
namespace {

using catalogue::CurveQuantity;
using catalogue::EventKind;
using catalogue::FrameContent;

/// What a made-up curve has.
constexpr std::uint16_t made_samples = 400;
constexpr std::uint16_t made_sampling_ms = 5;

modbus::Pdu long_pdu(std::uint8_t function, const Bytes& data) {
  modbus::Pdu pdu = {.function = function, .data = {}};
  put_u16(pdu.data, static_cast<std::uint16_t>(data.size()));
  pdu.data.insert(pdu.data.end(), data.begin(), data.end());
  return pdu;
}

void put_float(Bytes& bytes, float value) {
  const auto pattern = std::bit_cast<std::uint32_t>(value);
  put_u16(bytes, static_cast<std::uint16_t>(pattern >> 16U));
  put_u16(bytes, static_cast<std::uint16_t>(pattern & 0xFFFFU));
}

Bytes bytes_of(RegisterView registers) {
  Bytes bytes;
  for (const std::uint16_t word : registers) put_u16(bytes, word);
  return bytes;
}

std::int64_t value_of(const EventBlock::Values& values, std::string_view name) {
  const auto found = std::find_if(values.begin(), values.end(),
                                  [name](const auto& one) { return one.first == name; });
  return found == values.end() ? 0 : found->second;
}

/// A screw that turns freely, is seated, and is tightened.
float made_torque(float share, float reached) {
  constexpr float free_torque = 0.1F;
  constexpr float seated = 0.7F;
  if (share < seated) return free_torque * reached;
  const float rise = (share - seated) / (1.0F - seated);
  return reached * (free_torque + (1.0F - free_torque) * rise);
}

}  // namespace

const catalogue::Parameter* EventBlock::field(std::string_view name) const {
  const auto found =
      std::find_if(facts_->fields.begin(), facts_->fields.end(),
                   [name](const catalogue::Parameter& one) { return one.name.view() == name; });
  return found == facts_->fields.end() ? nullptr : &*found;
}

std::int64_t EventBlock::get(std::string_view name) const {
  if (facts_->first) return bank_->get(name);
  const catalogue::Parameter* one = field(name);
  return one == nullptr ? 0 : own_[one->address.value];
}

void EventBlock::put(std::string_view name, std::int64_t value) {
  if (facts_->first) return bank_->set(name, value);
  const catalogue::Parameter* one = field(name);
  if (one == nullptr) return;
  const catalogue::Encoding& encoding = one->encoding;
  const std::uint64_t pattern = encoding.is_float()
                                    ? std::bit_cast<std::uint32_t>(static_cast<float>(value))
                                    : static_cast<std::uint64_t>(value);
  catalogue::put_pattern(encoding, pattern,
                         std::span(own_).subspan(one->address.value, register_count(encoding)));
}

bool EventBlock::knows(catalogue::EventKind kind) const {
  return facts_ && std::any_of(facts_->kinds.begin(), facts_->kinds.end(),
                               [kind](const auto& entry) { return entry.value == kind; });
}

void EventBlock::emit(catalogue::EventKind kind, const Values& values, TimePoint now) {
  if (!facts_) return;
  const auto row = std::find_if(facts_->kinds.begin(), facts_->kinds.end(),
                                [kind](const auto& entry) { return entry.value == kind; });
  for (const auto& [name, value] : values) put(name, value);
  put(facts_->number, (number() + 1) & 0xFFFF);
  put(facts_->kind, row == facts_->kinds.end() ? 0 : row->key);
  put(facts_->flag, 1);
  const bool is_result = kind == EventKind::fastening_ok || kind == EventKind::fastening_ng;
  samples_.clear();
  if (is_result) {
    samples_ = samples({.torque = static_cast<float>(value_of(values, "event.torque")),
                        .angle = static_cast<float>(value_of(values, "event.a3"))});
  }
  if (facts_->curves) put_curves();
  for (const modbus::Pdu& pushed : frames(is_result)) send(pushed, Audience::armed, now);
}

void EventBlock::tell(Registers block, const std::optional<Reached>& result, Audience audience,
                      TimePoint now) {
  if (!facts_) return;
  block.resize(facts_->count);
  if (facts_->first) {
    for (std::size_t at = 0; at < block.size(); ++at) {
      bank_->put(catalogue::table_of(*facts_), static_cast<std::uint16_t>(*facts_->first + at),
                 block[at]);
    }
  } else {
    own_ = std::move(block);
  }
  samples_ = result ? samples(*result) : std::vector<Bytes>();
  if (facts_->curves) put_curves();
  for (const modbus::Pdu& pushed : frames(result.has_value())) send(pushed, audience, now);
}

void EventBlock::send(const modbus::Pdu& frame, Audience audience, TimePoint now) {
  for (const auto& [connection, until] : armed_until_) {
    if (now < until) pushes_.push_back({connection, frame});
  }
  if (audience == Audience::armed) return;
  for (const ConnectionId connection : connected_) {
    const auto armed = armed_until_.find(connection);
    const bool is_told = armed != armed_until_.end() && now < armed->second;
    if (!is_told) pushes_.push_back({connection, frame});
  }
}

/// What the block says of the curves of the last result.
void EventBlock::put_curves() {
  const catalogue::CurveSpec& curves = *facts_->curves;
  for (std::size_t at = 0; at < curves.channels.size(); ++at) {
    const CurveQuantity wanted = at == 0 ? CurveQuantity::torque : CurveQuantity::angle;
    const auto type = std::find_if(curves.types.begin(), curves.types.end(),
                                   [wanted](const auto& one) { return one.is == wanted; });
    const bool is_there = at < samples_.size() && type != curves.types.end();
    put(curves.channels[at].type, is_there ? type->number : 0);
    put(curves.channels[at].count, is_there ? made_samples : 0);
  }
  put(curves.sampling, samples_.empty() ? 0 : made_sampling_ms);
  if (facts_->first) return;
  constexpr std::array<std::pair<unsigned, unsigned>, 3> made_steps = {{{4, 0}, {7, 70}, {9, 99}}};
  for (std::size_t step = 0; step < std::min<std::size_t>(made_steps.size(), curves.steps);
       ++step) {
    const auto [index, per_cent] = made_steps[step];
    const bool is_there = !samples_.empty() && index < curves.step_types.size();
    const std::size_t at = curves.first_step + 2 * step;
    own_[at] = is_there ? static_cast<std::uint16_t>(curves.step_types[index].number) : 0;
    own_[at + 1] = is_there ? static_cast<std::uint16_t>(made_samples * per_cent / 100) : 0;
  }
}

std::vector<Bytes> EventBlock::samples(const Reached& result) const {
  if (!facts_->curves || facts_->curves->channels.size() < 2) return {};
  std::vector<Bytes> channels(2);
  for (unsigned at = 0; at < made_samples; ++at) {
    const float share = static_cast<float>(at) / static_cast<float>(made_samples - 1);
    put_float(channels[0], made_torque(share, result.torque));
    put_float(channels[1], share * result.angle);
  }
  return channels;
}

std::optional<Registers> EventBlock::block() const {
  if (!facts_->first) return own_;
  const auto block = bank_->read(catalogue::table_of(*facts_), *facts_->first, count_);
  if (!block) return std::nullopt;
  return Registers(block->begin(), block->end());
}

/// The last event in one of the forms that the product has, each in its turn.
std::vector<modbus::Pdu> EventBlock::frames(bool has_curves) const {
  const auto as_answer = frame();
  if (!as_answer) return {};
  std::vector<modbus::Pdu> all = {*as_answer};
  const auto turn = static_cast<std::size_t>(number()) % (facts_->frames.size() + 1);
  if (facts_->frames.empty()) return all;
  const Bytes data = bytes_of(*block());
  const auto function_of = [this](FrameContent content) -> std::optional<std::uint8_t> {
    const auto found = std::find_if(facts_->frames.begin(), facts_->frames.end(),
                                    [content](const auto& one) { return one.holds == content; });
    return found == facts_->frames.end() ? std::nullopt : std::optional(found->function);
  };
  const auto whole = function_of(FrameContent::event_with_curves);
  if (whole && turn == 0) {
    Bytes with_samples = data;
    for (const Bytes& channel : samples_) {
      with_samples.insert(with_samples.end(), channel.begin(), channel.end());
    }
    return {long_pdu(*whole, with_samples)};
  }
  const auto event = function_of(FrameContent::event);
  if (event && turn == 1) all = {long_pdu(*event, data)};
  const auto curve = function_of(FrameContent::curve);
  for (std::size_t channel = 0; curve && has_curves && channel < samples_.size(); ++channel) {
    Bytes part;
    put_u16(part, static_cast<std::uint16_t>(channel + 1));
    put_u16(part, static_cast<std::uint16_t>(samples_[channel].size() / 4));
    part.insert(part.end(), samples_[channel].begin(), samples_[channel].end());
    all.push_back(long_pdu(*curve, part));
  }
  return all;
}

void EventBlock::arm(ConnectionId connection, std::int64_t value, TimePoint now) {
  const catalogue::Arming& arming = *facts_->arm;
  if (value == arming.value) {
    const bool expires = arming.expires > Duration::zero();
    armed_until_[connection] = expires ? now + arming.expires : TimePoint::max();
  } else if (value == arming.disarm) {
    armed_until_.erase(connection);
  }
}

std::optional<modbus::Pdu> EventBlock::frame() const {
  if (!facts_ || facts_->model != catalogue::EventModel::push) return std::nullopt;
  const auto last = block();
  if (!last) return std::nullopt;
  return modbus::read_response(catalogue::table_of(*facts_), *last);
}

std::vector<Push> EventBlock::take_pushes(ConnectionId connection) {
  const auto others = std::stable_partition(
      pushes_.begin(), pushes_.end(),
      [connection](const Push& push) { return push.connection == connection; });
  std::vector<Push> taken(std::make_move_iterator(pushes_.begin()),
                          std::make_move_iterator(others));
  pushes_.erase(pushes_.begin(), others);
  return taken;
}

void EventBlock::connected(ConnectionId connection) {
  disconnected(connection);
  connected_.insert(connection);
  if (facts_ && !facts_->arm) armed_until_[connection] = TimePoint::max();
}

void EventBlock::disconnected(ConnectionId connection) {
  armed_until_.erase(connection);
  connected_.erase(connection);
  static_cast<void>(take_pushes(connection));
}

void EventBlock::restart() {
  armed_until_.clear();
  pushes_.clear();
  if (facts_) put(facts_->number, 0);
}

}  // namespace spindle::sim
