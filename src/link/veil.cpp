#include "spindle/link/veil.hpp"

#include <algorithm>
#include <utility>
#include <variant>

namespace spindle::link {
namespace {

/// More requests whose answers may still come are never out.
constexpr std::size_t most_asked = 16;

constexpr std::size_t word_size = 2;

std::uint8_t reader_of(modbus::RegisterTable table) {
  const bool is_input = table == modbus::RegisterTable::input;
  return static_cast<std::uint8_t>(is_input ? modbus::FunctionCode::read_input_registers
                                            : modbus::FunctionCode::read_holding_registers);
}

void clear_from(Bytes& data, std::size_t at) {
  if (at < data.size()) {
    std::fill(data.begin() + static_cast<std::ptrdiff_t>(at), data.end(), std::uint8_t{0});
  }
}

RegisterRange range_of(const modbus::WriteMultipleRequest& write) {
  return {write.table, write.first.value, static_cast<std::uint16_t>(write.values.size())};
}

}  // namespace

bool Veil::hides(modbus::RegisterTable table, std::uint32_t address) const {
  return std::any_of(secrets_.begin(), secrets_.end(), [&](const RegisterRange& secret) {
    return secret.table == table && address >= secret.first &&
           address < std::uint32_t{secret.first} + secret.count;
  });
}

bool Veil::touches(const RegisterRange& range) const {
  for (std::uint32_t i = 0; i < range.count; ++i) {
    if (hides(range.table, range.first + i)) return true;
  }
  return false;
}

/// The words of these registers stand from `at` on.
void Veil::cover(const RegisterRange& range, Bytes& data, std::size_t at) const {
  for (std::uint32_t i = 0; i < range.count; ++i) {
    const std::size_t word = at + word_size * i;
    if (word + word_size > data.size() || !hides(range.table, range.first + i)) continue;
    data[word] = data[word + 1] = 0;
  }
}

modbus::Pdu Veil::request(modbus::Pdu pdu) const {
  const auto parsed = modbus::parse_request(pdu);
  if (!parsed) return pdu;
  constexpr std::size_t value_at = 2;
  constexpr std::size_t values_at = 5;
  if (const auto* one = std::get_if<modbus::WriteSingleRequest>(&*parsed)) {
    cover({one->table, one->address.value, 1}, pdu.data, value_at);
  } else if (const auto* many = std::get_if<modbus::WriteMultipleRequest>(&*parsed)) {
    if (!modbus::holds_bits(many->table)) cover(range_of(*many), pdu.data, values_at);
  }
  return pdu;
}

modbus::Pdu Veil::response(modbus::Pdu pdu) const {
  // The echo of a write is its request once more.
  constexpr auto writes_one =
      static_cast<std::uint8_t>(modbus::FunctionCode::write_single_register);
  if (pdu.function == writes_one) {
    constexpr std::size_t value_at = 2;
    if (pdu.data.size() >= value_at &&
        hides(modbus::RegisterTable::holding, get_u16(pdu.data, 0))) {
      clear_from(pdu.data, value_at);
    }
    return pdu;
  }
  bool is_known = false;
  for (const RegisterRange& asked : asked_) {
    const bool fits = pdu.function == reader_of(asked.table) &&
                      pdu.data.size() == 1 + word_size * std::size_t{asked.count};
    if (!fits) continue;
    is_known = true;
    cover(asked, pdu.data, 1);
  }
  const bool is_strange =
      !is_known && is_awaited_ && pdu.function == reader_of(asked_.back().table);
  if (is_strange) clear_from(pdu.data, 1);
  return pdu;
}

/// What the request is about decides what of its answer is shown.
void Veil::note(const modbus::Pdu& pdu) {
  is_awaited_ = false;
  const auto parsed = modbus::parse_request(pdu);
  if (!parsed) return;
  if (const auto* read = std::get_if<modbus::ReadRequest>(&*parsed)) {
    const RegisterRange range{read->table, read->first.value, read->count};
    if (!touches(range)) return;
    is_awaited_ = is_drawn_ = true;
    std::erase(asked_, range);
    asked_.push_back(range);
    if (asked_.size() > most_asked) asked_.pop_front();
  } else if (const auto* one = std::get_if<modbus::WriteSingleRequest>(&*parsed)) {
    is_drawn_ |= touches({one->table, one->address.value, 1});
  } else if (const auto* many = std::get_if<modbus::WriteMultipleRequest>(&*parsed)) {
    is_drawn_ |= touches(range_of(*many));
  }
}

Bytes Veil::request(modbus::Framing framing, const modbus::Adu& adu) {
  note(adu.pdu);
  modbus::Adu shown = adu;
  shown.pdu = request(std::move(shown.pdu));
  return modbus::frame(framing, shown);
}

Bytes Veil::received(modbus::Framing framing, ByteView bytes) {
  if (!is_drawn_) return {bytes.begin(), bytes.end()};
  held_.insert(held_.end(), bytes.begin(), bytes.end());
  Bytes shown;
  while (!held_.empty()) {
    auto found = modbus::deframe(framing, modbus::Role::client, held_);
    if (std::holds_alternative<modbus::NeedMore>(found)) break;
    std::size_t size = held_.size();
    if (auto* frame = std::get_if<modbus::Deframed>(&found)) {
      size = frame->consumed;
      shown.insert(shown.end(), frame->skipped, std::uint8_t{0});
      frame->adu.pdu = response(std::move(frame->adu.pdu));
      const Bytes whole = modbus::frame(framing, frame->adu);
      shown.insert(shown.end(), whole.begin(), whole.end());
    } else {
      const std::size_t junk = std::get<modbus::Junk>(found).size;
      if (junk > 0) size = std::min(size, junk);
      shown.insert(shown.end(), size, std::uint8_t{0});
    }
    held_.erase(held_.begin(), held_.begin() + static_cast<std::ptrdiff_t>(size));
  }
  return shown;
}

Bytes Veil::rest() { return Bytes(std::exchange(held_, {}).size(), std::uint8_t{0}); }

}  // namespace spindle::link
